"""Motion programs of an industrial control unit: moves as data, planning them, reading PDL 2."""
