"""Tables as CSV: every plain value of every row, with full precision."""

import csv
import io
from typing import Any

from graspbench.report.tables.model import Table, known
from graspbench.results.spreadsheet import inert


def to_csv(table: Table) -> str:
    """Return all plain values of a table's rows under their keys; lists and mappings are left out.

    Text that a spreadsheet would take for a formula is made inert by an apostrophe before it.
    """
    keys = list(dict.fromkeys(key for row in table.records for key in row))
    nested = {
        key for key in keys if any(isinstance(row.get(key), list | tuple | dict) for row in table.records)
    }
    plain = [key for key in keys if key not in nested]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([inert(key) for key in plain])
    writer.writerows([[_cell(row.get(key)) for key in plain] for row in table.records])
    return stream.getvalue()


def _cell(value: Any) -> Any:
    if not known(value):
        return ""
    return inert(value) if isinstance(value, str) else value
