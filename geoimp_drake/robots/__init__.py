"""Robots' own interfaces: drivers, and the loop that drives an arm through one."""
