"""The blocks of one arm."""
