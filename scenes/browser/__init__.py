"""Pages in the user's browser: access control, errors in callbacks, a scene in 3D, and the scene editor."""
