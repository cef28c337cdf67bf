"""What a controller will do, told before a run."""
