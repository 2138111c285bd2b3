"""Running of a scene: the simulation, its loop, strategies, views of its state, explanations and warnings."""
