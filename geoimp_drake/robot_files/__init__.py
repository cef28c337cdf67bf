"""Robots from URDF, SDF and MJCF files as the world publishes them, made ready for impedance."""
