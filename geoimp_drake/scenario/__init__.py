"""Scenarios as YAML: reading, overriding, checking, writing, and templates of one's own."""
