"""Diffraction at the edges of objects: chains of reflections around one edge or two, solved like reflections."""
