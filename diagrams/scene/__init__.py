"""The contents of the cell: arms, surfaces, bar, peg and hole."""
