"""Records in compiled code: a pointer to the block, whose fields are found through the block's header."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    infer_getattr,
    intrinsic,
    lower_getattr_generic,
    models,
    register_model,
)
from numba.np.arrayobj import populate_array

from graspbench.arrays import FloatArray
from graspbench.manipulation.compiled.record import Field, Record

R = TypeVar("R", bound=Record)

_WORD = ir.IntType(64)
_WORD_BYTES = 8


class RecordType(types.Type):
    """The compiled type of a record's class."""

    def __init__(self, record: type[Record]) -> None:
        self.record = record
        super().__init__(name=f"{record.__module__}.{record.__qualname__}")


register_model(RecordType)(models.OpaqueModel)


def opener(record: type[R]) -> Callable[[FloatArray], R]:
    """Return what makes a record of its block in compiled code."""
    record_type = RecordType(record)

    @intrinsic
    def open_record(_typing: Any, block: Any) -> Any:
        def lower(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            array = context.make_array(signature.args[0])(context, builder, args[0])
            return builder.bitcast(array.data, cgutils.voidptr_t)

        return record_type(block), lower

    return cast("Callable[[FloatArray], R]", open_record)


def opener_at(record: type[R]) -> Callable[[int], R]:
    """Return what makes a record of its block's address in compiled code."""
    record_type = RecordType(record)

    @intrinsic
    def open_record(_typing: Any, address: Any) -> Any:
        def lower(_context: Any, builder: Any, _signature: Any, args: Any) -> Any:
            return builder.inttoptr(args[0], cgutils.voidptr_t)

        return record_type(address), lower

    return cast("Callable[[int], R]", open_record)


def _type_of(field: Field) -> Any:
    number = types.int64 if field.integer else types.float64
    return number if field.shape is None else types.Array(number, len(field.shape), "C")


@infer_getattr
class _Attributes(AttributeTemplate):  # type: ignore[misc]
    key = RecordType

    def generic_resolve(self, record_type: Any, name: str) -> Any:
        return next((_type_of(f) for f in record_type.record.declared if f.name == name), None)


@lower_getattr_generic(RecordType)
def _attribute(context: Any, builder: Any, record_type: Any, pointer: Any, name: str) -> Any:
    """Load a number, or build the array that the header tells of; it owns nothing, so it is not counted."""
    field = next(f for f in record_type.record.declared if f.name == name)
    words = builder.bitcast(pointer, _WORD.as_pointer())

    def word(k: int) -> Any:
        return builder.load(builder.gep(words, [_WORD(k)]))

    number = context.get_value_type(types.int64 if field.integer else types.float64)
    if field.shape is None:
        at = builder.gep(words, [_WORD(field.header)])
        return builder.load(builder.bitcast(at, number.as_pointer()))
    data = builder.bitcast(builder.gep(words, [word(field.header)]), number.as_pointer())
    shape, named = [], field.header + 1
    for length in field.shape:
        shape.append(word(named) if isinstance(length, str) else _WORD(length))
        named += isinstance(length, str)
    strides = [_WORD(_WORD_BYTES)]
    for length in reversed(shape[1:]):
        strides.insert(0, builder.mul(strides[0], length))
    array = context.make_array(_type_of(field))(context, builder)
    populate_array(array, data, shape, strides, _WORD_BYTES, None)
    return array._getvalue()
