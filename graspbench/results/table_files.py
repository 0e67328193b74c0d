"""A table of trials as CSV and Parquet, without pandas: loading that takes longer than most tables."""

import csv
import io
import json
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from graspbench.results.spreadsheet import inert

if TYPE_CHECKING:
    import pyarrow as pa

Rows = Sequence[Mapping[str, Any]]
"""One row a trial, by column; what is missing, None or NaN is an empty cell."""


def csv_text(columns: Sequence[str], rows: Rows) -> str:
    """Return a table as CSV; text that a spreadsheet would compute has an apostrophe before it."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([inert(name) for name in columns])
    cells = [[_shown(cell) for cell in _alike(_column(name, rows))] for name in columns]
    writer.writerows(zip(*cells, strict=True))
    return buffer.getvalue()


def parquet_bytes(columns: Sequence[str], rows: Rows, is_switch: Callable[[str], bool]) -> bytes:
    """Return a table as a Parquet file: columns keep their types, missing values are null.

    Args:
        columns: The columns' names.
        rows: The rows.
        is_switch: Tells whether a column without any value is one of truth values; it is text if not.
    """
    import pyarrow as pa  # here: these too take a while to load
    import pyarrow.parquet as pq

    arrays, described = [], []
    for name in columns:
        cells = _alike(_column(name, rows))
        kind = next((type(cell) for cell in cells if cell is not None), bool if is_switch(name) else str)
        if kind is int and any(cell is not None and not -(2**63) <= cell < 2**63 for cell in cells):
            kind, cells = str, [None if cell is None else str(cell) for cell in cells]
        arrays.append(_array(cells, kind))
        described.append(_described(name, kind))
    # What pandas reads to give columns with missing values their types back.
    note = {"index_columns": [], "column_indexes": [], "columns": described, "pandas_version": "2.0.0"}
    schema = pa.schema(
        [pa.field(name, array.type) for name, array in zip(columns, arrays, strict=True)],
        metadata={b"pandas": json.dumps(note).encode()},
    )
    sink = io.BytesIO()
    pq.write_table(pa.Table.from_arrays(arrays, schema=schema), sink)
    return sink.getvalue()


def _array(cells: list[Any], kind: type) -> "pa.Array":
    """Return a column as Arrow keeps it; Arrow's own conversion of a list would load pandas to ask it."""
    import pyarrow as pa

    valid = np.packbits(np.array([cell is not None for cell in cells], dtype=bool), bitorder="little")
    if kind is str:
        texts = [b"" if cell is None else cell.encode() for cell in cells]
        ends = np.cumsum([0, *map(len, texts)], dtype=np.int64)
        return pa.Array.from_buffers(
            pa.large_string(), len(cells), [pa.py_buffer(part) for part in (valid, ends, b"".join(texts))]
        )
    filled: npt.NDArray[Any] = np.array([0 if cell is None else cell for cell in cells], dtype=kind)
    data = np.packbits(filled, bitorder="little") if kind is bool else filled
    types = {bool: pa.bool_(), int: pa.int64(), float: pa.float64()}
    return pa.Array.from_buffers(types[kind], len(cells), [pa.py_buffer(valid), pa.py_buffer(data)])


def _column(name: str, rows: Rows) -> list[Any]:
    return [_plain(row.get(name)) for row in rows]


def _plain(cell: Any) -> Any:
    """Return a cell as Python's own value, None where there is none."""
    if hasattr(cell, "item"):  # a scalar of NumPy
        cell = cell.item()
    return None if cell is None or cell != cell else cell


def _alike(cells: list[Any]) -> list[Any]:
    """Return a column's cells in one type: whole numbers beside others as such, anything else as text."""
    kinds = {type(cell) for cell in cells if cell is not None}
    if kinds == {int, float}:
        return [None if cell is None else float(cell) for cell in cells]
    if len(kinds) > 1 or not kinds <= {bool, int, float, str}:
        return [None if cell is None else str(cell) for cell in cells]
    return cells


def _shown(cell: Any) -> str:
    if cell is None:
        return ""
    return inert(cell) if isinstance(cell, str) else str(cell)


def _described(name: str, kind: type) -> dict[str, Any]:
    pandas_type, numpy_type = {
        bool: ("bool", "boolean"),
        int: ("int64", "Int64"),
        float: ("float64", "Float64"),
        str: ("unicode", "string"),
    }[kind]
    types = {"pandas_type": pandas_type, "numpy_type": numpy_type}
    return {"name": name, "field_name": name, **types, "metadata": None}
