"""What moves a scene: the simulation, its loop, strategies, views of its state and what it says of itself."""
