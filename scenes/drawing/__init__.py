"""Pictures of a scene: floor plan and perspective."""
