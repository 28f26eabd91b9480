"""Renderers that blend Gaussians on the (φ, θ) plane, on the CPU and on the GPU; this room imports no model."""
