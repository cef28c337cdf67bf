"""Compositions: each calls laws of other files in the order of the blocks, in one compiled call."""
