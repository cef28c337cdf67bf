"""Robots from published URDF, SDF and MJCF files, made ready for impedance control."""
