"""The blocks of two arms that hold one object."""
