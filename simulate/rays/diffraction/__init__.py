"""Diffraction at edges: chains with one or two edges, found, solved and evaluated."""
