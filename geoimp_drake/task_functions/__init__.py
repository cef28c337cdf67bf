"""Task functions w(q) that a redundant arm climbs or descends by (3.39), one per file."""
