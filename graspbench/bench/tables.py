"""A benchmark's rows as files."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from graspbench.bench.result import BenchResult
from graspbench.results.store import write_atomically


def write_tables(result: BenchResult, output_dir: Path) -> tuple[Path, ...]:
    """Write each table of a benchmark as CSV, at full precision, and all of them as one Markdown file.

    Args:
        result: What was measured.
        output_dir: Folder of ``<name>.csv``, ``<name>-<table>.csv`` and ``<name>.md``; made if need be.
    """
    tables = {result.name: result.rows} | {f"{result.name}-{key}": t for key, t in result.tables.items()}
    files = []
    for name, rows in tables.items():
        files.append(output_dir / f"{name}.csv")
        write_atomically(files[-1], pd.DataFrame(rows).to_csv(index=False, lineterminator="\n"))
    files.append(output_dir / f"{result.name}.md")
    write_atomically(files[-1], "\n".join(markdown(name, rows) for name, rows in tables.items()))
    return tuple(files)


def markdown(title: str, rows: Sequence[Mapping[str, object]]) -> str:
    """Return rows as a Markdown table under a heading, four digits a number."""
    names = list(rows[0]) if rows else []
    lines = [f"## {title}", "", _line(names), "|" + "---|" * len(names)]
    lines += [_line([_cell(row[name]) for name in names]) for row in rows]
    return "\n".join(lines) + "\n"


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cells) + " |"


def _cell(value: object) -> str:
    if value is None:
        return ""
    text = f"{value:.4g}" if isinstance(value, float) else str(value)
    return text.replace("|", "\\|")
