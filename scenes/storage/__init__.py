"""A scene on disk: a scene.yaml and its meshes."""
