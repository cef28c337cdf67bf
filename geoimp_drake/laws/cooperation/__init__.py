"""Two arms that hold one object: (4.1)-(4.15)."""
