"""Contents of a scene: bodies, shapes, materials, laws, meshes and surfaces."""
