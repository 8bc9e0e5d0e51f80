"""The arrays of `views` without reference counting, which would take time at every slice."""

from __future__ import annotations

from typing import Any

from numba import float64, intp, types
from numba.core import cgutils
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, models, register_model
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
        source = context.make_array(data)(context, builder, source)
        return _array(context, builder, array, builder.gep(source.data, [start]), shape)

    return array(data, *(1 + dimensions) * (types.intp,)), generate


def _array(context: Any, builder: Any, array: Any, begin: Any, shape: list[Any]) -> Any:
    """Returns the array of this type that begins at an address."""
    size = context.get_abi_sizeof(context.get_data_type(array.dtype))
    strides = [context.get_constant(types.intp, size)]
    for extent in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], extent))
    result = context.make_array(array)(context, builder)
    populate_array(result, begin, shape, strides, size, None)
    return result._getvalue()


class _Table(types.Type):
    """The type of all arrays of a table. A value contains where the arrays begin, and code for a view is made
    only where an array is used: a tuple of a hundred arrays would be a thousand numbers, which the compiler
    would have to copy at each use.

    Attributes:
        views: for each array its memory, its index in the memory's `where`, and its shape.
        sizes: the type of the values of the letters.
    """

    def __init__(self, table: type, views: dict[str, tuple[str, int, list[str]]], sizes: Any) -> None:
        self.views, self.sizes = views, sizes
        super().__init__(name=f"{table.__module__}.{table.__qualname__}")

    def array(self, name: str) -> Any:
        """Returns the type of an array."""
        memory, _, shape = self.views[name]
        return types.Array(_MEMORY[memory], len(shape), "C")


_MEMORY = {"data": float64, "whole": intp}


@register_model(_Table)
class _TableModel(models.StructModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        starts = types.CPointer(intp)
        members = [("data", types.CPointer(float64)), ("data_where", starts), ("whole", starts)]
        super().__init__(manager, kind, [*members, ("whole_where", starts), ("sizes", kind.sizes)])


@infer_getattr
class _TableAttributes(AttributeTemplate):
    key = _Table

    def generic_resolve(self, table: Any, name: str) -> Any:
        """Returns the type of an array, None if the table has no array of this name."""
        return table.array(name) if name in table.views else None


@lower_getattr_generic(_Table)
def _array_of(context: Any, builder: Any, kind: Any, value: Any, name: str) -> Any:
    table = cgutils.create_struct_proxy(kind)(context, builder, value=value)
    memory, index, shape = kind.views[name]
    start = builder.load(builder.gep(getattr(table, f"{memory}_where"), [context.get_constant(intp, index)]))
    # The beginnings of the arrays never change, so that the code need not read one again after each number
    # that it writes.
    start.set_metadata("invariant.load", builder.module.add_metadata([]))
    letters = kind.sizes.fields
    extents = [
        context.get_constant(intp, int(size))
        if size.isdecimal()
        else builder.extract_value(table.sizes, letters.index(size))
        for size in shape
    ]
    begin = builder.gep(getattr(table, memory), [start])
    return _array(context, builder, kind.array(name), begin, extents)


def arrays_in(table: type, numbers: dict[str, str], wholes: dict[str, str]) -> Any:
    """See `views`."""
    views = {
        name: (memory, index, shape.split())
        for memory, shapes in (("data", numbers), ("whole", wholes))
        for index, (name, shape) in enumerate(shapes.items())
    }

    def arrays(_: Any, data: Any, where: Any, whole: Any, whole_where: Any, s: Any) -> Intrinsic:
        kind = _Table(table, views, s)

        def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            result = cgutils.create_struct_proxy(kind)(context, builder)
            for name, type_, value in zip(_MEMBERS, signature.args, arguments, strict=False):
                setattr(result, name, context.make_array(type_)(context, builder, value).data)
            result.sizes = arguments[-1]
            return result._getvalue()

        return kind(data, where, whole, whole_where, s), generate

    return intrinsic(arrays)


_MEMBERS = "data", "data_where", "whole", "whole_where"


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
