"""What measures: wrist sensors and frame motions."""
