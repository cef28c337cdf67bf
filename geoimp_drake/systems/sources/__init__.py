"""Sources of desired motions and external wrenches."""
