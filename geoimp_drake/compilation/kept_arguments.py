"""What numba compiles for a law with fixed first arguments, see `compiled.bound`.

The arguments stand in a table: eight bytes for a number, address and shape for an array. The law is
compiled for their types and takes the table's address.
"""

from collections.abc import Callable, Iterator
from copy import deepcopy
from functools import partial
from typing import Any

import numpy as np
from llvmlite import ir
from numba import typeof
from numba.core import cgutils, types
from numba.core.typing.templates import signature
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array

__all__ = ["KeptArguments", "kinds_of", "unpacked"]

_WORD = ir.IntType(64)


class KeptArguments(partial):
    """A compiled law with its first arguments; a deep copy has copies of their arrays.

    Args:
        law: compiled for the types of the arguments; takes the address of a table of them.
        arguments: arrays are not copied: the law reads what is written to them later.
    """

    table: np.ndarray
    arguments: tuple[Any, ...]

    def __new__(cls, law: Callable[..., Any], arguments: tuple[Any, ...]) -> "KeptArguments":
        """Writes the table.

        Raises:
            ValueError: an array is not contiguous.
        """
        table = np.array(_entries(arguments), dtype=np.uint64)
        kept = super().__new__(cls, law, table.ctypes.data)
        kept.table, kept.arguments = table, arguments
        return kept

    def __deepcopy__(self, memo: dict[int, Any]) -> "KeptArguments":
        return KeptArguments(self.func, deepcopy(self.arguments, memo))


def kinds_of(arguments: tuple[Any, ...]) -> types.BaseTuple:
    """Returns the types of arguments; a read-only array counts as any other."""
    return typeof(_as_writable(arguments))


def _as_writable(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return np.empty((0,) * value.ndim, value.dtype)
    if isinstance(value, tuple):
        items = map(_as_writable, value)
        return type(value)(*items) if hasattr(value, "_fields") else tuple(items)
    return value


def _entries(value: Any) -> list[int]:
    if isinstance(value, tuple):
        return [entry for item in value for entry in _entries(item)]
    if isinstance(value, np.ndarray):
        if not value.flags.c_contiguous:
            raise ValueError("An argument that stays must be a contiguous array.")
        return [value.ctypes.data, *value.shape]
    dtype = np.float64 if isinstance(value, float) else np.int64
    return [int(np.array(value, dtype=dtype).view(np.uint64))]


@intrinsic  # type: ignore[untyped-decorator]
def unpacked(typing_context: Any, kinds: Any, address: Any) -> Any:
    """Returns arguments of these types from the table at an address."""

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        table = builder.inttoptr(args[1], _WORD.as_pointer())
        places = (builder.gep(table, [_WORD(place)]) for place in range(1 << 16))
        return _read(context, builder, sig.return_type, map(builder.load, places))

    return signature(kinds.instance_type, kinds, address), code


def _read(context: Any, builder: Any, kind: Any, entries: Iterator[Any]) -> Any:
    """Returns a value of a type from the next entries of a table, in machine code."""
    if isinstance(kind, types.BaseTuple):
        items = [_read(context, builder, item, entries) for item in kind]
        return context.make_tuple(builder, kind, items)
    if isinstance(kind, types.Array):
        return _read_array(context, builder, kind, entries)
    number = next(entries)
    if isinstance(kind, types.Float):
        return builder.bitcast(number, ir.DoubleType())
    return cgutils.is_not_null(builder, number) if isinstance(kind, types.Boolean) else number


def _read_array(context: Any, builder: Any, kind: Any, entries: Iterator[Any]) -> Any:
    """Returns an array; without a `meminfo` numba does not count its references."""
    entry_type = context.get_data_type(kind.dtype)
    data = builder.inttoptr(next(entries), entry_type.as_pointer())
    shape = [next(entries) for _ in range(kind.ndim)]
    strides = [_WORD(context.get_abi_sizeof(entry_type))]
    for size in shape[:0:-1]:
        strides.insert(0, builder.mul(strides[0], size))
    array = context.make_array(kind)(context, builder)
    populate_array(array, data, shape, strides, strides[-1], meminfo=None)
    return array._getvalue()
