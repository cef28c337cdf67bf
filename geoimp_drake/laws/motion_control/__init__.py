"""The inner motion loop and the torques: (2.3)-(2.15)."""
