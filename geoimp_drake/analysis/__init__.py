"""Predicts the behaviour of a controller before a run."""
