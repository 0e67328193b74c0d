"""The results folder: one folder a trial, written whole or not at all.

A trial is written into ``.<trial id>.<process>.partial`` and renamed when it is complete; the tables
``trials.csv`` and ``trials.parquet`` are made anew from the trials' ``result.json`` files and replaced in
one step. A process that is killed leaves at most a ``.partial`` folder, or the trial it was replacing as
``.<trial id>.old``, which is then read instead; never half a result.
"""

import errno
import fcntl
import json
import os
import secrets
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from graspbench.errors import LogError, OutputError
from graspbench.results.columns import is_switch, trial_rows
from graspbench.results.migrations import SCHEMA_VERSION, migrate
from graspbench.results.plain import result_from_plain
from graspbench.results.table_files import csv_text, parquet_bytes
from graspbench.results.trial_result import TrialResult

__all__ = [
    "RESULT_FILE",
    "SCHEMA_VERSION",
    "LoadedResults",
    "ResultStore",
    "load_results",
    "read_result",
    "write_atomically",
]

RESULT_FILE = "result.json"
TABLE_FILE = "trials.csv"
# What a disk says when it takes nothing more: whatever is being done, it must stop.
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS)
_MAX_RESULT_BYTES = 64 << 20
_MAX_VALUES = 20_000  # each is a column of tables, or may be
_CLAIMS_FILE = ".claims"


class ResultStore:
    """The trials of one experiment on disk.

    Args:
        root: The experiment's folder; made when the first trial is written.
    """

    def __init__(self, root: Path) -> None:
        self.root = root

    def folder(self, trial_id: str) -> Path:
        """Return the folder of a finished trial."""
        final = self.root / trial_id
        old = _old(final)
        return old if old.exists() and not final.exists() else final

    def result(self, trial_id: str) -> TrialResult | None:
        """Return a finished trial's result, or None when there is none.

        One whose file cannot be read has the status "unreadable", and the reason.
        """
        path = self.folder(trial_id) / RESULT_FILE
        return _readable(path, trial_id) if path.is_file() else None

    def version(self, trial_id: str) -> int | None:
        """Return a number that changes when a trial's result is written anew; None when there is none."""
        try:
            return (self.folder(trial_id) / RESULT_FILE).stat().st_mtime_ns
        except FileNotFoundError:
            return None

    @contextmanager
    def claim(self, trial_id: str) -> Iterator[bool]:
        """Claim a trial for this process; gives whether nobody else has it.

        Two sweeps in one folder, also on two machines that share it, so never run a trial at the same
        time. A claim is a lock on one byte of one file: it ends with the process, however that ends.
        """
        with writable(self.root):
            self.root.mkdir(parents=True, exist_ok=True)
            opened = open_for_appending(self.root / _CLAIMS_FILE)
        with opened as stream:
            try:
                fcntl.lockf(stream, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, int(trial_id, 16))
            except OSError:
                yield False
            else:
                yield True

    @contextmanager
    def writing(self, trial_id: str) -> Iterator[Path]:
        """Give a folder to write a trial into; it gets its final name on a clean exit, else it goes."""
        partial = self.root / f".{trial_id}.{os.getpid()}.partial"
        made = [folder for folder in (self.root, *self.root.parents) if not folder.exists()]
        shutil.rmtree(partial, ignore_errors=True)
        with writable(self.root):
            partial.mkdir(parents=True)
        try:
            yield partial
        except BaseException:
            _discard(partial, made)
            raise
        with writable(self.root):
            self._publish(partial, self.root / trial_id)
        for left in self.remains(trial_id):
            shutil.rmtree(left, ignore_errors=True)

    def remains(self, trial_id: str) -> list[Path]:
        """Return the folders of a trial that processes left behind when they were killed."""
        return sorted(self.root.glob(f".{trial_id}.*.partial"))

    def results(self) -> list[TrialResult]:
        """Return every finished trial's result, ordered by trial id."""
        ids = {path.parent.name for path in self.root.glob(f"[!.]*/{RESULT_FILE}")}
        ids |= {path.parent.name[1:-4] for path in self.root.glob(f".*.old/{RESULT_FILE}")}
        return [result for trial_id in sorted(ids) if (result := self.result(trial_id)) is not None]

    def write_table(self) -> Path:
        """Rebuild ``trials.csv`` and ``trials.parquet`` from the results; return the former's path."""
        path, table = self.root / TABLE_FILE, trial_rows(self.results())
        write_atomically(path, csv_text(table.columns, table.rows))
        parquet = parquet_bytes(table.columns, table.rows, is_switch)
        write_atomically(path.with_suffix(".parquet"), parquet)
        return path

    def _publish(self, partial: Path, final: Path) -> None:
        old = _old(final)
        if final.exists():
            shutil.rmtree(old, ignore_errors=True)
            final.rename(old)
        try:
            partial.rename(final)
        except OSError:
            if not (final / RESULT_FILE).is_file():
                raise
            shutil.rmtree(partial)  # another process has just finished the same trial
        shutil.rmtree(old, ignore_errors=True)


def _discard(partial: Path, made: list[Path]) -> None:
    """Remove what a trial that failed has written, and the folders that were made for it."""
    shutil.rmtree(partial, ignore_errors=True)
    for folder in made:
        with suppress(OSError):  # somebody else has written there meanwhile
            folder.rmdir()


@contextmanager
def writable(path: Path) -> Iterator[None]:
    """Turn what the system says when a place cannot be written into one sentence.

    Raises:
        OutputError: It cannot.
    """
    try:
        yield
    except OSError as error:
        raise no_room(path, error) from error


def open_for_appending(path: Path) -> BinaryIO:
    """Open a file of a results folder, made where there is none.

    The folder may come from somebody: a link there may lead out of it, a pipe would be waited for.

    Raises:
        OSError: It is no regular file, or cannot be written.
    """
    flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
    stream = os.fdopen(os.open(path, flags, 0o666), "ab")
    if not stat.S_ISREG(os.fstat(stream.fileno()).st_mode):
        stream.close()
        raise OSError(errno.EINVAL, "it is no regular file", str(path))
    return stream


def is_own_file(path: Path) -> bool:
    """Tell whether a path is a regular file itself, no link to one: a link may lead out of a folder."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except OSError:
        return False


def no_room(path: Path, error: OSError) -> OutputError:
    """Return the sentence about a place that cannot be written."""
    return OutputError(
        f"nothing can be written to {path} ({error.strerror or error})",
        remedy="choose another place with --output, or make room there",
        path=path,
    )


def _old(final: Path) -> Path:
    """Return where a trial's folder waits while a new one takes its place."""
    return final.with_name(f".{final.name}.old")


def read_result(path: Path) -> TrialResult:
    """Read a ``result.json`` of this version or an older one.

    Raises:
        LogError: The file cannot be read, or is of a newer schema than this version knows.
    """
    try:
        if not is_own_file(path):
            raise ValueError("it is no regular file")
        if path.stat().st_size > _MAX_RESULT_BYTES:
            raise ValueError(f"it has more than {_MAX_RESULT_BYTES >> 20} MB")
        text = path.read_text(encoding="utf-8")
        values = json.loads(text)
        if "\\u" in text:  # half a character is no text: nothing that it is in could be written
            json.dumps(values, ensure_ascii=False).encode()
        if _values_in(values) > _MAX_VALUES:
            raise ValueError(f"it has more than {_MAX_VALUES} values")
        return result_from_plain(migrate(values, path))
    except (OSError, ValueError, RecursionError, TypeError, AttributeError) as error:
        reason = str(error) or type(error).__name__
        raise LogError(
            f"the result {path} cannot be read ({reason})", remedy="run its trial again", path=path
        ) from error


@dataclass(frozen=True)
class LoadedResults:
    """Trials that were read from results folders.

    Attributes:
        results: The trials.
        folders: Each one's folder, by trial id.
    """

    results: tuple[TrialResult, ...]
    folders: dict[str, str]


def load_results(folders: list[Path]) -> LoadedResults:
    """Read all trials below some results folders, each trial once (the first folder wins).

    A trial whose file cannot be read is there with the status "unreadable".

    Raises:
        LogError: A folder does not exist or holds no trial.
    """
    merged: dict[str, TrialResult] = {}
    places: dict[str, str] = {}
    for folder in folders:
        if not folder.is_dir():
            raise LogError(f"there is no results folder {folder}", remedy="give one that 'sweep' wrote")
        found = sorted(path for path in folder.rglob(RESULT_FILE) if _is_trial(path))
        if not found:
            raise LogError(f"{folder} holds no finished trial", remedy="run 'graspbench sweep' first")
        for path in found:
            result = _readable(path, path.parent.name)
            if result.trial_id not in merged:
                merged[result.trial_id] = result
                places[result.trial_id] = str(path.parent)
    return LoadedResults(tuple(merged.values()), places)


def _is_trial(path: Path) -> bool:
    """Tell a trial's result from the document of a whole experiment, which has the same name."""
    return not path.parent.name.startswith(".") and (path.parent / "config.yaml").is_file()


def _readable(path: Path, trial_id: str) -> TrialResult:
    try:
        return read_result(path)
    except LogError as error:
        return TrialResult(trial_id=trial_id, status="unreadable", reason=str(error))


def _values_in(document: object) -> int:
    """Return how many values and containers a JSON document has."""
    count, waiting = 0, [document]
    while waiting:
        found = waiting.pop()
        count += 1
        if isinstance(found, dict):
            waiting.extend(found.values())
        elif isinstance(found, list):
            waiting.extend(found)
    return count


def write_atomically(path: Path, content: str | bytes) -> None:
    """Write a file so that readers see the old content or the new, never a part.

    Raises:
        OutputError: It cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(6)}.tmp")
    with writable(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with temporary.open("xb") as stream:
                stream.write(content.encode() if isinstance(content, str) else content)
                stream.flush()
                os.fsync(stream.fileno())
            os.replace(temporary, path)
        except OSError:
            temporary.unlink(missing_ok=True)
            raise
