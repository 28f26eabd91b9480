"""Pages in the user's browser: access control, errors in callbacks, and a scene in 3D with antennas to move."""
