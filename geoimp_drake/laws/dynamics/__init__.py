"""Kinematics and dynamics of a chain of joints: (2.1), (2.2)."""
