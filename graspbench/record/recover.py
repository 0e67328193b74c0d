"""Reading logs back: what is in one, and what can be saved of a broken one."""

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mcap.records import Attachment, Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import Writer

from graspbench.errors import LogError

_MAGIC = b"\x89MCAP0\r\n"
_LARGEST = 1 << 30


@dataclass(frozen=True)
class LogInfo:
    """What a log holds.

    Attributes:
        path: The file.
        size_bytes: Its size.
        complete: Whether it was closed properly and is undamaged; if not, `recover_log` helps.
        damaged_chunks: Number of chunks whose checksum or compression is broken.
        messages: Number of messages by topic.
        schemas: Name of each topic's schema.
        duration_s: Time between the first and the last message.
        attachments: Names and texts of the attachments.
        metadata: Key-value pairs by name.
    """

    path: Path
    size_bytes: int
    complete: bool
    damaged_chunks: int
    messages: dict[str, int]
    schemas: dict[str, str]
    duration_s: float
    attachments: dict[str, str]
    metadata: dict[str, dict[str, str]]

    @property
    def message_count(self) -> int:
        """Number of messages in all."""
        return sum(self.messages.values())


@dataclass
class _Content:
    """What was read before the end, or before the damage."""

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    damaged_chunks: int = 0
    complete: bool = False


def log_info(path: Path) -> LogInfo:
    """Read a log from its beginning to its end, or to where it is cut.

    Args:
        path: ``*.mcap`` or ``*.mcap.partial``.

    Raises:
        LogError: There is no such file, or it is no MCAP file.
    """
    content = _Content()
    counts: Counter[int] = Counter()
    attachments: dict[str, str] = {}
    metadata: dict[str, dict[str, str]] = {}
    first: int | None = None
    last = 0
    for record in _records(path, content):
        if isinstance(record, Message) and record.channel_id in content.channels:
            counts[record.channel_id] += 1
            first = record.log_time if first is None else min(first, record.log_time)
            last = max(last, record.log_time)
        elif isinstance(record, Attachment):
            attachments[record.name] = record.data.decode(errors="replace")
        elif isinstance(record, Metadata):
            metadata[record.name] = dict(record.metadata)
    return LogInfo(
        path=path,
        size_bytes=path.stat().st_size,
        complete=content.complete,
        damaged_chunks=content.damaged_chunks,
        messages={content.channels[i].topic: counts[i] for i in sorted(content.channels) if counts[i]},
        schemas={
            c.topic: content.schemas[c.schema_id].name
            for c in content.channels.values()
            if c.schema_id in content.schemas
        },
        duration_s=0.0 if first is None else (last - first) * 1e-9,
        attachments=attachments,
        metadata=metadata,
    )


def recover_log(path: Path, output: Path | None = None) -> LogInfo:
    """Write all that is readable of a broken log as a whole one.

    Args:
        path: The broken log; it is left as it is.
        output: The new file; by default the name without ``.partial``, or ``*.recovered.mcap``.

    Returns:
        What the new file holds.

    Raises:
        LogError: The file is missing, is no MCAP file, holds no message, or the output exists.
    """
    target = output or _recovered_name(path)
    if target.exists():
        raise LogError(
            f"'{target}' exists already", remedy="name another output or remove it", path=str(target)
        )
    temporary = target.with_name(target.name + ".writing")
    try:
        count = _copy(path, temporary)
        if count == 0:
            raise LogError(
                f"'{path}' holds no readable message", remedy="run the trial again", path=str(path)
            )
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)
    return log_info(target)


def _recovered_name(path: Path) -> Path:
    if path.suffix == ".partial":
        return path.with_suffix("")
    return path.with_suffix(".recovered.mcap")


def _copy(path: Path, output: Path) -> int:
    """Copy every readable record but the end; return the number of messages."""
    content = _Content()
    schemas: dict[int, int] = {0: 0}
    channels: dict[int, int] = {}
    count = 0
    writer: Any = None
    with _opened(output) as stream:
        for record in _records(path, content):
            if writer is None:
                writer = Writer(stream)
                writer.start(profile="", library="graspbench")
            if isinstance(record, Schema) and record.id not in schemas:
                schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
            elif isinstance(record, Channel) and record.id not in channels:
                channels[record.id] = writer.register_channel(
                    record.topic, record.message_encoding, schemas[record.schema_id], record.metadata
                )
            elif isinstance(record, Message) and record.channel_id in channels:
                channel = channels[record.channel_id]
                writer.add_message(
                    channel, record.log_time, record.data, record.publish_time, record.sequence
                )
                count += 1
            elif isinstance(record, Attachment):
                writer.add_attachment(
                    record.create_time, record.log_time, record.name, record.media_type, record.data
                )
            elif isinstance(record, Metadata):
                writer.add_metadata(record.name, record.metadata)
        if writer is not None:
            writer.finish()
    return count


def _opened(output: Path) -> Any:
    try:
        return output.open("wb")
    except OSError as error:
        raise LogError(f"cannot write '{output}': {error.strerror}", path=str(output)) from error


def _records(path: Path, content: _Content) -> Iterator[McapRecord]:
    """Yield the data section's records in order, up to its end or the first damage."""
    try:
        stream = path.open("rb")
    except OSError as error:
        raise LogError(f"cannot read log '{path}': {error.strerror}", path=str(path)) from error
    with stream:
        if stream.read(len(_MAGIC)) != _MAGIC:
            raise LogError(
                f"'{path}' is no MCAP file", remedy="give a *.mcap or *.mcap.partial file", path=str(path)
            )
        stream.seek(0)
        limit = min(_LARGEST, path.stat().st_size)
        records = StreamReader(stream, emit_chunks=True, record_size_limit=limit).records
        while True:
            try:
                outer = next(records, None)
            except Exception:  # cut or damaged bytes raise errors of any kind in the decoders
                return
            if outer is None:
                content.complete = content.damaged_chunks == 0
                return
            for record in _opened_chunk(outer, content) if isinstance(outer, Chunk) else (outer,):
                if isinstance(record, Schema):
                    content.schemas[record.id] = record
                elif isinstance(record, Channel):
                    content.channels[record.id] = record
                yield record


def _opened_chunk(chunk: Chunk, content: _Content) -> Sequence[McapRecord]:
    """Return the records of a chunk; none when it is damaged, the next ones may be whole."""
    try:
        if chunk.uncompressed_size > _LARGEST:
            raise ValueError
        records: Sequence[McapRecord] = breakup_chunk(chunk, validate_crc=True)
        return records
    except Exception:
        content.damaged_chunks += 1
        return ()
