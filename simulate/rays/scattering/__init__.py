"""Diffuse reflection at rough surfaces."""
