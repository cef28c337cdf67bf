"""The six-DOF impedance and its orientation families: (3.1)-(3.31), Table 2.1."""
