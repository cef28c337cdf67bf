"""Runs, logs, judges and draws simulations: nothing here computes a control law."""
