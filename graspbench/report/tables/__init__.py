"""One model of a table, and one writer per format: CSV, Markdown, LaTeX, terminal and JSON."""

from graspbench.report.tables.csv_format import to_csv
from graspbench.report.tables.files import TABLE_FORMATS, table_files, write_tables
from graspbench.report.tables.json_format import to_json_rows
from graspbench.report.tables.latex_format import escape_latex, to_latex
from graspbench.report.tables.markdown_format import escape_markdown, to_markdown
from graspbench.report.tables.model import SIGNIFICANT, Column, Row, Rows, Table, plain_table, value_text
from graspbench.report.tables.terminal_format import to_terminal

__all__ = [
    "SIGNIFICANT",
    "TABLE_FORMATS",
    "Column",
    "Row",
    "Rows",
    "Table",
    "escape_latex",
    "escape_markdown",
    "plain_table",
    "table_files",
    "to_csv",
    "to_json_rows",
    "to_latex",
    "to_markdown",
    "to_terminal",
    "value_text",
    "write_tables",
]
