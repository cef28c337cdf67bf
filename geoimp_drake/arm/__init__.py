"""An arm of anybody's plant: its kinematic tree, the controller's own model of it, its state."""
