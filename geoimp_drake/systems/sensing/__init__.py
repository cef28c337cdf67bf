"""Sensors: of wrists, and of frame motions."""
