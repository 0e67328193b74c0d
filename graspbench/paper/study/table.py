"""The compact table of all grasps of the study, kept as Parquet so that figures are drawn without physics."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

import graspbench.datasets
from graspbench.errors import ConfigurationError
from graspbench.results.store import write_atomically

KEPT = Path(graspbench.datasets.__path__[0]) / "quality_study.parquet"
"""The table that comes with Graspbench."""

SCHEMA = 1
LISTS = ("forces_weight", "torques_weight", "points", "normals")
KEYS = ("case", "object", "hand", "stratum", "friction", "mass_kg", "held", *LISTS)

Row = dict[str, Any]


def read_table(path: Path = KEPT) -> pd.DataFrame:
    """Return a stored table, one row a grasp.

    Raises:
        ConfigurationError: The file is missing, cannot be read, or is no such table.
    """
    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise ConfigurationError(
            f"the study's table {path} cannot be read", remedy="leave it to 'graspbench paper quality-study'"
        ) from error
    frame: pd.DataFrame = table.to_pandas()
    missing = [key for key in KEYS if key not in frame]
    if missing:
        raise ConfigurationError(
            f"{path} is no table of the study: it has no column '{missing[0]}'",
            remedy="take the one that comes with graspbench",
        )
    return frame


def write_table(frame: pd.DataFrame, path: Path) -> None:
    """Write a table, numbers to seven digits; nothing is left half-written."""
    compact = frame.copy()
    for name in compact.columns:
        if compact[name].dtype == np.float64:
            compact[name] = compact[name].astype(np.float32)
    metadata = {b"graspbench": f"quality study, schema {SCHEMA}".encode()}
    table = pa.Table.from_pandas(compact, preserve_index=False)
    table = table.replace_schema_metadata({**(table.schema.metadata or {}), **metadata})
    sink = pa.BufferOutputStream()
    pq.write_table(table, sink, compression="zstd")
    write_atomically(path, sink.getvalue().to_pybytes())


def with_rows(frame: pd.DataFrame | None, rows: Sequence[Row]) -> pd.DataFrame:
    """Return a table with further rows, in the order of cases."""
    added = pd.DataFrame(list(rows))
    for name in LISTS:
        if name in added:
            added[name] = pd.Series([np.asarray(each, dtype=np.float32) for each in added[name]])
    parts = [part for part in (frame, added) if part is not None and len(part)]
    return pd.concat(parts, ignore_index=True) if len(parts) > 1 else parts[0] if parts else added
