"""One Drake LeafSystem a file: ports, cache and state around the laws."""
