"""Datasets of other programs into this format, and datasets of this format into other programs'."""
