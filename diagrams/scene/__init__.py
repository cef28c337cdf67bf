"""What stands in the cell: arms, surfaces, bar, peg and hole."""
