"""Readers of mesh files, one for each format. Each returns named parts of triangles, and says what it left out."""
