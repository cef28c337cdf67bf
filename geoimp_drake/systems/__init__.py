"""One Drake LeafSystem per file: ports, cache and state around the laws."""
