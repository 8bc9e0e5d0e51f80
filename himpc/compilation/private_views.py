"""The arrays of `views` without reference counting, which would take time at every slice."""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array

Intrinsic = tuple[Any, Any]
"""A signature, and the function that generates the code."""


def _vector(_: Any, data: Any, start: Any, n: Any) -> Intrinsic:
    return _view(data, 1)


def _matrix(_: Any, data: Any, start: Any, rows: Any, columns: Any) -> Intrinsic:
    return _view(data, 2)


def _matrices(_: Any, data: Any, start: Any, count: Any, rows: Any, columns: Any) -> Intrinsic:
    return _view(data, 3)


def _view(data: Any, dimensions: int) -> Intrinsic:
    """Returns a view of `data` that begins at an index, as an array with this number of dimensions."""
    array = types.Array(data.dtype, dimensions, "C")

    def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        source, start, *shape = arguments
        source, result = context.make_array(data)(context, builder, source), context.make_array(array)
        size = context.get_abi_sizeof(context.get_data_type(data.dtype))
        strides = [context.get_constant(types.intp, size)]
        for extent in reversed(shape[1:]):
            strides.insert(0, builder.mul(strides[0], extent))
        result = result(context, builder)
        populate_array(result, builder.gep(source.data, [start]), shape, strides, size, None)
        return result._getvalue()

    return array(data, *(1 + dimensions) * (types.intp,)), generate


def _unowned(_: Any, array: Any) -> Intrinsic:
    def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        source, result = (
            context.make_array(array)(context, builder, *values) for values in ((arguments[0],), ())
        )
        for name in ("nitems", "itemsize", "data", "shape", "strides"):
            setattr(result, name, getattr(source, name))
        for name in ("meminfo", "parent"):
            setattr(result, name, cgutils.get_null_value(getattr(result, name).type))
        return result._getvalue()

    return array(array), generate


vector: Any = intrinsic(_vector)
matrix: Any = intrinsic(_matrix)
matrices: Any = intrinsic(_matrices)
borrowed: Any = intrinsic(_unowned)
