"""Check whether a scene is possible: occupied space, enclosed space, and obstacles to the gateway's array."""
