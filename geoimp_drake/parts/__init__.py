"""Pieces of controllers: named inputs, memory and outputs around the laws; no Drake systems."""
