"""Tables of trials as files: pandas reads from them what was put in."""

import io

import numpy as np
import pandas as pd

from graspbench.results.columns import is_switch
from graspbench.results.table_files import csv_text, parquet_bytes

ROWS = (
    {"n": 3, "mixed": 1, "x": 0.1, "yes": True, "text": 'a,"b"\nc', "kinds": 1.5, "big": 2**70},
    {"n": None, "mixed": 2.5, "x": np.float64(1e-12), "yes": None, "text": "=1+1", "kinds": "auto", "big": 1},
    {"n": -7, "mixed": float("nan"), "x": float("inf"), "yes": False, "kinds": True, "big": None},
)
COLUMNS = ("n", "mixed", "x", "yes", "text", "kinds", "big", "none", "-head")


def test_csv_has_empty_cells_for_what_is_missing_and_nothing_that_a_spreadsheet_computes():
    text = csv_text(COLUMNS, ROWS)
    assert text.splitlines()[0] == "n,mixed,x,yes,text,kinds,big,none,'-head"
    table = pd.read_csv(io.StringIO(text), dtype=str, keep_default_na=False)
    assert table["n"].tolist() == ["3", "", "-7"]
    assert table["mixed"].tolist() == ["1.0", "2.5", ""]
    assert table["x"].tolist() == ["0.1", "1e-12", "inf"]
    assert table["yes"].tolist() == ["True", "", "False"]
    assert table["text"].tolist() == ['a,"b"\nc', "'=1+1", ""]
    assert table["kinds"].tolist() == ["1.5", "auto", "True"]
    assert table["none"].tolist() == [""] * 3


def test_parquet_keeps_types_beside_missing_values():
    table = pd.read_parquet(io.BytesIO(parquet_bytes(COLUMNS, ROWS, lambda name: name == "-head")))
    assert [str(kind) for kind in table.dtypes] == [
        "Int64", "Float64", "Float64", "boolean", "string", "string", "string", "string", "boolean"
    ]  # fmt: skip
    assert table["n"].dropna().tolist() == [3, -7]
    assert table["x"].tolist() == [0.1, 1e-12, float("inf")]
    assert table["text"].dropna().tolist() == ['a,"b"\nc', "=1+1"]
    assert table["big"].dropna().tolist() == [str(2**70), "1"]
    assert table[["none", "-head"]].isna().all().all()


def test_a_table_without_rows_is_its_head():
    assert csv_text(("a", "b"), ()) == "a,b\n"
    assert list(pd.read_parquet(io.BytesIO(parquet_bytes(("a", "b"), (), lambda _: False)))) == ["a", "b"]


def test_a_yes_or_no_is_one_whatever_its_name_ends_with():
    # Its name ends like a force in weights; a column without any value must not become one of text.
    assert is_switch("strengthened.for_weight")
    assert not is_switch("execution.largest_push_weight")
