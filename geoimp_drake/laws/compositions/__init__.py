"""Laws in the order of the blocks, for one compiled call; they have no algebra of their own."""
