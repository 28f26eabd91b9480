"""Diffraction at the edges of objects: chains of reflections before and after one edge, solved like reflections."""
