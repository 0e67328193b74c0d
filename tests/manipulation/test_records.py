from typing import Annotated

import numpy as np
import pytest

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled
from graspbench.manipulation.compiled.record import Record
from graspbench.manipulation.compiled.record_type import opener, opener_at


class Base(Record):
    """What all have."""

    gain: float
    count: int
    parents: Annotated[IntArray, "joints"]
    frames: Annotated[FloatArray, "joints", 3, "columns"]


class Derived(Base):
    """A base with more, of which one size is new."""

    margin: float
    limits: Annotated[FloatArray, "watched", 2]


open_derived, base_at = opener(Derived), opener_at(Base)


@compiled
def read_and_write(block, address, frames):
    record, base = open_derived(block), base_at(address)
    frames[:] = base.frames
    base.frames[-1, 2, 1] = record.gain + record.margin * base.count
    record.parents[0] = record.limits.shape[0] * 10 + record.limits.shape[1]
    record.limits[1, 1] = base.gain


def make(**given):
    values = {"gain": 2.0, "count": 3, "parents": [4, 5, 6, 7], "margin": 0.5, "limits": np.ones((2, 2))}
    return Derived(sizes={"columns": 2}, **{**values, **given})


def test_python_and_compiled_code_see_the_same_fields():
    record, frames = make(), np.empty((4, 3, 2))
    record.frames[:] = np.arange(24).reshape(4, 3, 2)
    read_and_write(record.block, record.address, frames)
    np.testing.assert_array_equal(frames, np.arange(24).reshape(4, 3, 2))
    assert record.frames[-1, 2, 1] == 2.0 + 0.5 * 3
    assert list(record.parents) == [22, 5, 6, 7]
    np.testing.assert_array_equal(record.limits, [[1, 1], [1, 2]])
    assert (record.gain, record.count, record.margin) == (2.0, 3, 0.5)


def test_fields_do_not_overlap_and_fill_the_block():
    record = make()
    used = np.zeros(len(record.block), dtype=bool)
    header = sum(field.words for field in record.declared)
    used[:header] = True
    for field in record.declared:
        if field.shape is not None:
            view = getattr(record, field.name)
            start = (view.__array_interface__["data"][0] - record.address) // 8
            assert not used[start : start + view.size].any()
            used[start : start + view.size] = True
    assert used.all()
    assert [f.name for f in record.declared][:4] == [f.name for f in Base.declared]
    assert [f.header for f in record.declared][:4] == [f.header for f in Base.declared]


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"tilt": 1.0}, TypeError, "no field tilt"),
        (
            {"frames": np.zeros((5, 3, 2))},
            ValueError,
            r"\(5, 3, 2\), not \(joints, 3, columns\) = \(4, 3, 2\)",
        ),
        ({"frames": np.zeros((4, 2, 2))}, ValueError, r"frames has shape \(4, 2, 2\)"),
        ({"limits": np.zeros(2)}, ValueError, r"limits has shape \(2,\), not \(watched, 2\)"),
    ],
)
def test_values_that_do_not_fit_are_refused(given, error, message):
    with pytest.raises(error, match=message):
        make(**given)


def test_what_is_missing_is_told():
    with pytest.raises(TypeError, match="needs a value for gain"):
        Base(count=1, parents=[0], sizes={"columns": 1})
    with pytest.raises(ValueError, match="needs the sizes columns"):
        Base(gain=1.0, count=1, parents=[0])
