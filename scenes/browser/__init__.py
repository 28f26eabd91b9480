"""Pages in the user's browser: who may enter, errors in callbacks, a scene in 3D, and the editor of scenes."""
