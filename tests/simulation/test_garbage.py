"""The garbage collector looks only at what a simulation makes, and at all of it afterwards."""

import gc
import weakref

import pytest

from geoimp_drake.simulation.garbage import only_new_garbage


class Node:
    def __init__(self) -> None:
        self.itself = self


def test_garbage_made_meanwhile_is_collected() -> None:
    with only_new_garbage():
        new = weakref.ref(Node())
        gc.collect()
        assert new() is None


def test_what_was_there_is_left_alone_until_the_end() -> None:
    node = Node()
    old = weakref.ref(node)
    with only_new_garbage():
        assert gc.get_freeze_count() > 0
        del node
        gc.collect()
        assert old() is not None
    assert gc.get_freeze_count() == 0
    gc.collect()
    assert old() is None


def test_an_error_ends_it() -> None:
    with pytest.raises(ValueError, match="stopped"), only_new_garbage():
        raise ValueError("stopped")
    assert gc.get_freeze_count() == 0
