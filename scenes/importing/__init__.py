"""Meshes and scene files of other programs, turned into scenes."""
