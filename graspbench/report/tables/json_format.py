"""Tables as plain values for JSON."""

from typing import Any

from graspbench.report.tables.model import Table


def to_json_rows(table: Table) -> dict[str, Any]:
    """Return caption, notes and all values of a table."""
    return {
        "caption": table.caption,
        "notes": list(table.notes),
        "rows": [dict(row) for row in table.records],
    }
