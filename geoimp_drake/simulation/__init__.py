"""Running, logging, judging, drawing: nothing here computes a control law."""
