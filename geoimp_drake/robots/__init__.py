"""Robots' own interfaces: drivers, and what drives an arm through one."""
