"""Where desired motions and external wrenches come from."""
