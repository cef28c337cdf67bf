"""The set-ups, one file for each kind, and the parts that they share."""
