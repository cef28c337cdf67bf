"""An arm of any plant: its kinematic tree, the controller's own model of it, its state."""
