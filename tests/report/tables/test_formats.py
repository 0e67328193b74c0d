"""One table in every format: numbers, bold, parts, and text that is no markup."""

import csv
import io
import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from graspbench.errors import ConfigurationError
from graspbench.report.tables import (
    SIGNIFICANT,
    Column,
    Table,
    escape_latex,
    plain_table,
    table_files,
    to_csv,
    to_json_rows,
    to_latex,
    to_markdown,
    to_terminal,
    write_tables,
)
from graspbench.results.spreadsheet import inert
from tests.report import latex

ROWS = (
    {"object": "a_b", "index": "x", "q": 0.51234, "std": 0.0213, "time": 3.0, "n": 3, "list": [1]},
    {"object": "a_b", "index": "y", "q": 0.7, "std": None, "time": 1.25, "n": 4, "list": []},
    {"object": "c", "index": "x", "q": 0.9, "std": 0.1, "time": 2.0, "n": 4, "list": []},
    {"object": "c", "index": "y", "q": 0.9, "std": 0.1, "time": math.nan, "n": 4, "list": []},
)
COLUMNS = (
    Column("object", "object"),
    Column("index", "index"),
    Column("q", "local / global", format=SIGNIFICANT, group="Q1", spread="std", best="largest"),
    Column("time", "time", "s", ".2f", best="smallest"),
)
TABLE = Table(
    "things", "Errors & angles", COLUMNS, ROWS, ("k_cm is off.",), compared=("object",), parted=("object",)
)


def terminal(table, width=None):
    console = Console(width=width or 500, file=io.StringIO(), markup=False, force_terminal=False)
    console.print(to_terminal(table, width))
    return console.file.getvalue()


def test_csv_holds_every_plain_value_with_full_precision():
    rows = list(csv.DictReader(io.StringIO(to_csv(TABLE))))
    assert list(rows[0]) == ["object", "index", "q", "std", "time", "n"]
    assert [float(row["q"]) for row in rows] == [row["q"] for row in ROWS]
    assert rows[1]["std"] == rows[3]["time"] == ""


def test_markdown_has_units_spreads_and_what_is_missing():
    text = to_markdown(TABLE)
    assert text.startswith("### Errors \\& angles\n\n| object | index | Q1 local / global | time \\[s\\] |\n")
    assert r"| a\_b | x | 0.512 ± 0.021 | 3.00 |" in text
    assert "| c | y | 0.900 ± 0.100 | - |" in text
    assert text.endswith("\nk\\_cm is off.\n")


def test_the_best_of_rows_that_are_compared_is_bold_unless_all_are_alike():
    assert TABLE.best_cells() == {(1, "q"), (1, "time")}
    lines = to_markdown(TABLE).splitlines()
    assert lines[5] == r"| a\_b | y | **0.700** | **1.25** |"
    assert to_latex(TABLE).count(r"\textbf") == 2
    nothing = Table("t", "T", COLUMNS, ROWS)
    assert nothing.best_cells() == frozenset()


def test_a_tie_that_is_best_is_bold_where_others_are_worse():
    rows = [{"q": 0.5}, {"q": 0.9}, {"q": 0.9000001}]
    table = Table("t", "T", (Column("q", "q", format=".2f", best="largest"),), tuple(rows), compared=())
    assert table.best_cells() == {(1, "q"), (2, "q")}


def test_json_holds_all_values():
    assert to_json_rows(TABLE) == {
        "caption": "Errors & angles",
        "notes": ["k_cm is off."],
        "rows": list(ROWS),
    }
    assert json.dumps(to_json_rows(plain_table("t", [{"a": 1}])))


def test_terminal_cuts_a_table_that_is_too_wide_and_repeats_the_names():
    whole = terminal(TABLE)
    assert whole.count("a_b") == 2
    assert "note: k_cm is off." in whole
    narrow = terminal(TABLE, 45)
    assert narrow.count("a_b") == 4
    assert max(map(len, narrow.splitlines())) <= 45


def test_columns_of_a_plain_table_are_the_keys():
    table = plain_table("t", [{"name": "a", "value": 0.012345, "ok": True, "none": None}], "T")
    assert [column.right for column in table.columns] == [False, True, False, True]
    assert "| a | 0.0123 | yes | - |" in to_markdown(table)


def test_a_table_without_rows_says_so():
    empty = Table("t", "Nothing", COLUMNS, ())
    assert "Nothing to show." in to_markdown(empty)
    assert "Nothing: nothing to show" in terminal(empty)
    assert r"\toprule" in to_latex(empty)


HOSTILE = "[red]<script>alert(1)</script>| `x` {{data}} \\input{/etc/passwd} $x$ %& ~^_#\nline 中 =1"


def test_nothing_in_a_table_is_markup():
    table = plain_table("t", [{"name": HOSTILE, "formula": "=cmd|'/c calc'!A1"}], HOSTILE, notes=[HOSTILE])
    markdown = to_markdown(table)
    assert "<script>" not in markdown.replace("\\<script\\>", "")
    rows = [line for line in markdown.splitlines() if line.startswith("|")]
    assert len({line.count("|") - line.count("\\|") for line in rows}) == 1
    assert "[red]<script>" in terminal(table)
    (record,) = csv.DictReader(io.StringIO(to_csv(table)))
    assert record["formula"].startswith("'=cmd")
    assert r"\input" not in to_latex(table)
    assert "U+4E2D" in to_latex(table)


@given(st.text())
def test_inert_text_starts_no_formula_and_keeps_the_rest(text):
    assert not inert(text).startswith(("=", "+", "-", "@"))
    assert inert(text).removeprefix("'") == text.removeprefix("'")


def test_latex_escapes_every_special_character():
    assert escape_latex(r"a_b & 5% #1 ~^ {x}\y $") == (
        r"a\_b \& 5\% \#1 \textasciitilde{}\textasciicircum{} \{x\}\textbackslash{}y \$"
    )


@pytest.mark.skipif(not latex.AVAILABLE, reason=latex.REASON)
def test_latex_of_any_table_compiles_and_fits(tmp_path):
    hostile = plain_table("h", [{"name": HOSTILE, "more": HOSTILE * 2, "x": -1.5}], HOSTILE, notes=[HOSTILE])
    wide = Table(
        "wide",
        "Wide",
        (Column("object", "object"), *(Column(f"v{k}", f"value number {k}", "mm", ".3f") for k in range(40))),
        tuple({"object": f"thing_{i}", **{f"v{k}": 1000.0 * k + i for k in range(40)}} for i in range(3)),
    )
    tall = Table(
        "tall", "Tall", COLUMNS, tuple({**ROWS[0], "object": i // 7} for i in range(150)), parted=("object",)
    )
    texts = [to_latex(table) for table in (TABLE, hostile, wide, tall)]
    log = latex.compiled(tmp_path, *texts)
    assert "Overfull" not in log
    assert "too large" not in log
    assert r"\begin{table}" in texts[0]
    assert texts[2].count(r"\begin{table*}") > 1
    assert texts[3].count(r"\begin{table}") == 4


def test_unknown_format_is_refused_before_anything_is_written(tmp_path):
    with pytest.raises(ConfigurationError, match="unknown table format 'xls'"):
        write_tables([TABLE], tmp_path / "report", ["csv", "xls"])
    assert not (tmp_path / "report").exists()
    assert list(table_files(TABLE)) == ["things.csv", "things.md", "things.tex"]
