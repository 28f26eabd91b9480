"""Diffuse reflection: rough surfaces as patches that each scatter a wave into all directions."""
