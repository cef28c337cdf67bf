"""Configurations, and the functions that make whole controllers for anybody's plant."""
