"""What a scene is made of: bodies, shapes, materials, laws, meshes and surfaces."""
