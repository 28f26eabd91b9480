"""Diffraction at edges: find, solve and evaluate chains with one or two edges."""
