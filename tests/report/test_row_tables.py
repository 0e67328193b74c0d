import io

import pandas as pd

from graspbench.report.row_tables import Column, row_tables

ROWS = [{"object": "a_b", "value": 1.23456, "n": 3, "list": [1]}, {"object": "c", "value": None, "n": 4}]
COLUMNS = (Column("object", "object", "object"), Column("value", "value, mm", "value [mm]", 2))


def test_csv_holds_every_plain_value():
    frame = pd.read_csv(io.StringIO(row_tables(ROWS, COLUMNS, "T", (), "l")["table.csv"]))
    assert list(frame.columns) == ["object", "value", "n"]
    assert frame["value"][0] == 1.23456
    assert frame["n"].tolist() == [3, 4]


def test_markdown_and_latex_round_escape_and_show_what_is_missing():
    tables = row_tables(ROWS, COLUMNS, "Errors & angles", ("k_cm is off.",), "tab:x")
    assert r"| a\_b | 1.23 |" in tables["table.md"]
    assert "| c | - |" in tables["table.md"]
    assert r"k\_cm is off." in tables["table.md"]
    assert r"a\_b & 1.23 \\" in tables["table.tex"]
    assert r"Errors \& angles" in tables["table.tex"]
    assert tables["table.tex"].count("{") == tables["table.tex"].count("}")
