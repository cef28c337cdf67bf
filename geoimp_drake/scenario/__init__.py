"""Scenarios as YAML: reads, overrides, checks and writes them, and makes templates."""
