"""What Python's garbage collector need not look at while a simulation runs."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["only_new_garbage"]


@contextmanager
def only_new_garbage() -> Iterator[None]:
    """Has the garbage collector look only at what is made from now on, until the end.

    Called for by the many small objects of every step, it would look again and again at all that
    has been there since the start: modules, plants, compiled laws. That is some percent of a loop.
    """
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
