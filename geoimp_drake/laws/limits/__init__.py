"""Limits of joints, torques, singularities and contact forces: (L.1)-(L.3), (L.8), (L.9)."""
