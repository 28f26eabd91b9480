"""Diffuse reflection off rough surfaces."""
