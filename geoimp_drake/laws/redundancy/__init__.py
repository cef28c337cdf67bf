"""Joint accelerations of arms with more than six joints: (3.32)-(3.39)."""
