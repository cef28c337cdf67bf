"""Keeps Python's garbage collector from scanning old objects while a simulation runs."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["only_new_garbage"]


@contextmanager
def only_new_garbage() -> Iterator[None]:
    """Makes the garbage collector scan only objects made from now on, until the context ends.

    The many small objects of every step trigger it. Each time it would scan all objects from the
    start: modules, plants, compiled laws. That takes some per cent of a loop's time.
    """
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
