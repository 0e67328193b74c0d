"""Our own format as JSON Lines: one grasp a line."""

import json
from collections.abc import Sequence
from pathlib import Path

from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.formats.format import FORMATS, FormatContext
from graspbench.evaluation.formats.plain import from_plain, to_plain
from graspbench.evaluation.grasp_record import GraspRecord
from graspbench.results.store import write_atomically


class JsonLines:
    """One JSON object a line, as docs/how-to/evaluate.md describes it."""

    description = "ours: one JSON object a line"
    suffixes: tuple[str, ...] = (".jsonl",)

    def recognises(self, path: Path) -> bool:
        """Take every file with the suffix."""
        del path
        return True

    def read(self, path: Path, context: FormatContext) -> tuple[GraspRecord, ...]:
        """Return the grasps of a file; see `GraspFormat.read`."""
        records = []
        try:
            with path.open(encoding="utf-8") as stream:
                for i, line in enumerate(stream, start=1):
                    if line.strip():
                        where = f"{path}, line {i}"
                        records.append(from_plain(_parsed(line, where), context, where))
        except UnicodeDecodeError:
            raise GraspFileError(f"{path} is no text in UTF-8", remedy="save it as JSON Lines") from None
        return tuple(records)

    def write(self, path: Path, records: Sequence[GraspRecord], context: FormatContext) -> None:
        """Write grasps; see `GraspFormat.write`."""
        del context
        lines = [json.dumps(to_plain(record), ensure_ascii=False) + "\n" for record in records]
        write_atomically(path, "".join(lines))


def _parsed(line: str, where: str) -> object:
    try:
        return json.loads(line)
    except (ValueError, RecursionError) as error:
        raise GraspFileError(
            f"{where} is no JSON ({str(error)[:80]})", remedy="give one object a line"
        ) from None


FORMATS.register("jsonl")(JsonLines())
