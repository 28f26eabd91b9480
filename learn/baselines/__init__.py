"""Baselines, which need no training and are scored next to every model, and the array's ceiling."""
