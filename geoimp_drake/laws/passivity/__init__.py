"""Energy that changing gains, or a sampled contact, would give out, and what is done about it."""
