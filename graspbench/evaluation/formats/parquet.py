"""Our own format as Parquet: one grasp a row."""

import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.formats.format import FORMATS, FormatContext
from graspbench.evaluation.formats.plain import from_plain, to_plain
from graspbench.evaluation.grasp_record import GraspRecord
from graspbench.results.store import write_atomically

_MAX_NUMBERS = 20_000_000


def _numbers_in(metadata: Any) -> int:
    """Return how many numbers and bytes a file has once it is unpacked."""
    groups = [metadata.row_group(i) for i in range(metadata.num_row_groups)]
    columns = [group.column(j) for group in groups for j in range(metadata.num_columns)]
    return sum(max(column.num_values, column.total_uncompressed_size // 8) for column in columns)


def schema() -> Any:
    """Return the Arrow schema of the rows."""
    numbers = pa.list_(pa.float64())
    pose = pa.struct([("position", numbers), ("quaternion_wxyz", numbers)])
    stage = pa.struct([("palm", pose), ("joints", numbers)])
    contact = pa.struct([("point", numbers), ("normal", numbers)])
    return pa.schema(
        [
            ("schema", pa.int32()),
            ("hand", pa.string()),
            ("joint_names", pa.list_(pa.string())),
            ("object", pa.string()),
            ("object_scale", pa.float64()),
            ("object_frame", pa.string()),
            ("object_pose", pose),
            ("approach", pa.list_(stage)),
            ("pregrasp", stage),
            ("grasp", stage),
            ("squeeze", stage),
            ("contacts", pa.list_(contact)),
            ("confidence", pa.float64()),
            ("source", pa.string()),
        ]
    )


class Parquet:
    """One row a grasp, with the fields of JSON Lines."""

    description = "ours: one row a grasp"
    suffixes: tuple[str, ...] = (".parquet",)

    def recognises(self, path: Path) -> bool:
        """Take every file with the suffix."""
        del path
        return True

    def read(self, path: Path, context: FormatContext) -> tuple[GraspRecord, ...]:
        """Return the grasps of a file; see `GraspFormat.read`."""
        try:
            if _numbers_in(pq.read_metadata(path)) > _MAX_NUMBERS:
                raise GraspFileError(f"{path} unfolds to too many numbers", remedy="split it")
            rows = pq.read_table(path).to_pylist()
        except (pa.ArrowException, OSError, ValueError) as error:
            raise GraspFileError(
                f"{path} is no readable Parquet file ({str(error)[:80]})", remedy="save it anew"
            ) from None
        return tuple(from_plain(row, context, f"{path}, row {i}") for i, row in enumerate(rows))

    def write(self, path: Path, records: Sequence[GraspRecord], context: FormatContext) -> None:
        """Write grasps; see `GraspFormat.write`."""
        del context
        buffer = io.BytesIO()
        pq.write_table(
            pa.Table.from_pylist([to_plain(record) for record in records], schema=schema()), buffer
        )
        write_atomically(path, buffer.getvalue())


FORMATS.register("parquet")(Parquet())
