"""The description of a scene: gateway, transmitter region, objects, radio materials, and tolerances."""
