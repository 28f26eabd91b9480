"""Models of the gateway's mirror images in the planes of a room."""
