"""Energy that changing gains or a sampled contact would inject, and what prevents it."""
