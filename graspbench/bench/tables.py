"""A benchmark's rows as files."""

from pathlib import Path

from graspbench.bench.result import BenchResult
from graspbench.report.tables import Table, plain_table, to_markdown, write_tables
from graspbench.results.store import write_atomically


def bench_tables(result: BenchResult) -> tuple[Table, ...]:
    """Return a benchmark's tables, the main one first."""
    further = (
        plain_table(f"{result.name}-{key}", rows, f"{result.name}: {key}")
        for key, rows in result.tables.items()
    )
    return (plain_table(result.name, result.rows, result.name), *further)


def write_bench(result: BenchResult, output_dir: Path) -> tuple[Path, ...]:
    """Write each table of a benchmark as CSV, at full precision, and all of them as one Markdown file.

    Args:
        result: What was measured.
        output_dir: Folder of ``<name>.csv``, ``<name>-<table>.csv`` and ``<name>.md``; made if need be.
    """
    tables = bench_tables(result)
    files = write_tables(tables, output_dir, ["csv"])
    together = output_dir / f"{result.name}.md"
    write_atomically(together, "\n".join(to_markdown(table) for table in tables))
    return (*files, together)
