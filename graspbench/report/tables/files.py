"""Tables as files."""

from collections.abc import Callable, Sequence
from pathlib import Path

from graspbench.errors import ConfigurationError
from graspbench.report.tables.csv_format import to_csv
from graspbench.report.tables.latex_format import to_latex
from graspbench.report.tables.markdown_format import to_markdown
from graspbench.report.tables.model import Table
from graspbench.results.store import write_atomically

_WRITERS: dict[str, tuple[str, Callable[[Table], str]]] = {
    "csv": ("csv", to_csv),
    "markdown": ("md", to_markdown),
    "latex": ("tex", to_latex),
}

TABLE_FORMATS = tuple(_WRITERS)


def table_files(table: Table, formats: Sequence[str] = TABLE_FORMATS) -> dict[str, str]:
    """Return a table as file contents by file name.

    Args:
        table: The table.
        formats: Any of `TABLE_FORMATS`.

    Raises:
        ConfigurationError: A format is unknown.
    """
    unknown = [name for name in formats if name not in _WRITERS]
    if unknown:
        raise ConfigurationError(
            f"unknown table format '{unknown[0]}'", remedy=f"choose from {', '.join(_WRITERS)}"
        )
    return {f"{table.name}.{_WRITERS[name][0]}": _WRITERS[name][1](table) for name in formats}


def write_tables(
    tables: Sequence[Table], folder: Path, formats: Sequence[str] = TABLE_FORMATS
) -> tuple[Path, ...]:
    """Write tables, one file a table and format.

    Args:
        tables: The tables; their names are the stems of the files.
        folder: Made if need be.
        formats: Any of `TABLE_FORMATS`.

    Returns:
        The files, table by table in the order of the formats.

    Raises:
        ConfigurationError: A format is unknown; nothing is written then.
    """
    contents = {name: text for table in tables for name, text in table_files(table, formats).items()}
    for name, text in contents.items():
        write_atomically(folder / name, text)
    return tuple(folder / name for name in contents)
