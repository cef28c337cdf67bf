"""Configurations, and the functions that make whole controllers for any plant."""
