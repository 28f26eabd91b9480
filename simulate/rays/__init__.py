"""Ray tracing: from a scene to the responses of the array's elements."""
