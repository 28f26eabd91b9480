"""Drawings of a scene: floor plan and perspective view."""
