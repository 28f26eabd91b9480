"""What a scene is: gateway, transmitter region, objects, radio materials, and how wrong its description may be."""
