"""A scene on disk: scene.yaml and the meshes in its folder."""
