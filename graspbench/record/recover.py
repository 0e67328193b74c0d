"""Reading logs back: what is in one, and what can be saved of a broken one."""

import dataclasses
import os
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.writer import Writer

from graspbench.errors import LogError
from graspbench.record.channels import CHANNELS
from graspbench.record.chunked_file import encoding_of
from graspbench.record.damaged import Damage, read_records


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
        lost: What could not be read, in words.
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
    lost: tuple[str, ...] = ()

    @property
    def message_count(self) -> int:
        """Number of messages in all."""
        return sum(self.messages.values())


@dataclass
class _Content:
    """What a file holds, whichever way it comes.

    Attributes:
        schemas: By id.
        channels: By id.
        damage: What could not be read.
        counts: Messages by channel id.
    """

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    damage: Damage = field(default_factory=Damage)
    counts: Counter[int] = field(default_factory=Counter)

    def lost(self) -> tuple[str, ...]:
        """Say what could not be read."""
        damage, said = self.damage, []
        if damage.chunks:
            known = {i: n for i, n in sorted(damage.messages.items()) if n}
            named = [f"{self.channels[i].topic} {n}" for i, n in known.items() if i in self.channels]
            of_others = sum(n for i, n in known.items() if i not in self.channels)
            named += [f"{of_others} of channels that are not described"] if of_others else []
            what = f", with the messages {', '.join(named)}" if named else ""
            said.append(f"damaged chunks: {damage.chunks}{what}")
        nameless = {i: n for i, n in sorted(self.counts.items()) if i not in self.channels}
        if nameless:
            said.append(f"messages whose channel is nowhere described: {sum(nameless.values())}")
        if damage.records:
            said.append(f"damaged attachments, metadata or index entries: {damage.records}")
        if damage.skipped_bytes:
            said.append(f"bytes that make no record: {damage.skipped_bytes}")
        return tuple(said)


def log_info(path: Path) -> LogInfo:
    """Read a log from its beginning to its end, past what is damaged.

    Args:
        path: ``*.mcap`` or ``*.mcap.partial``.

    Raises:
        LogError: There is no such file, or it is no MCAP file.
    """
    content = _Content()
    times: dict[int, tuple[int, int]] = {}
    attachments: dict[str, str] = {}
    metadata: dict[str, dict[str, str]] = {}
    for record in read_records(path, content.damage):
        if isinstance(record, Message):
            first, last = times.get(record.channel_id, (record.log_time, record.log_time))
            times[record.channel_id] = (min(first, record.log_time), max(last, record.log_time))
            content.counts[record.channel_id] += 1
        elif isinstance(record, Attachment):
            attachments[record.name] = record.data.decode(errors="replace")
        elif isinstance(record, Metadata):
            metadata[record.name] = dict(record.metadata)
        else:
            _describe(record, content)
    spans = [span for i, span in times.items() if i in content.channels]
    return LogInfo(
        path=path,
        size_bytes=path.stat().st_size,
        complete=content.damage.none,
        damaged_chunks=content.damage.chunks,
        messages={
            content.channels[i].topic: content.counts[i]
            for i in sorted(content.channels)
            if content.counts[i]
        },
        schemas={c.topic: _schema_name(c, content) for c in content.channels.values()},
        duration_s=(max(b for _, b in spans) - min(a for a, _ in spans)) * 1e-9 if spans else 0.0,
        attachments=attachments,
        metadata=metadata,
        lost=content.lost(),
    )


def _describe(record: Any, content: _Content) -> None:
    """Note a schema or a channel; the first of an id counts, as later ones repeat it."""
    if isinstance(record, Schema):
        content.schemas.setdefault(record.id, record)
    elif isinstance(record, Channel):
        content.channels.setdefault(record.id, record)


def _schema_name(channel: Channel, content: _Content) -> str:
    if channel.schema_id in content.schemas:
        return str(content.schemas[channel.schema_id].name)
    return encoding_of(channel.topic)[1][0] if channel.topic in CHANNELS else ""


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
    content = _Content()
    for record in read_records(path, content.damage):  # a log's end describes all its channels again
        if isinstance(record, Message):
            content.counts[record.channel_id] += 1
        _describe(record, content)
    if not any(content.counts[i] for i in content.channels):
        raise LogError(f"'{path}' holds no readable message", remedy="run the trial again", path=str(path))
    try:
        _copy(path, temporary, content)
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)
    return dataclasses.replace(log_info(target), lost=content.lost())


def _recovered_name(path: Path) -> Path:
    if path.suffix == ".partial":
        return path.with_suffix("")
    return path.with_suffix(".recovered.mcap")


def _copy(path: Path, output: Path, content: _Content) -> None:
    """Copy every readable message, attachment and metadata, with the channels that are described anywhere."""
    channels: dict[int, int] = {}
    with _opened(output) as stream:
        writer = Writer(stream)
        writer.start(profile="", library="graspbench")
        schemas: dict[tuple[str, str, bytes], int] = {}
        for record in read_records(path, Damage()):
            if isinstance(record, Message) and record.channel_id in content.channels:
                if record.channel_id not in channels:
                    channel = content.channels[record.channel_id]
                    channels[record.channel_id] = _register(writer, channel, content, schemas)
                writer.add_message(
                    channels[record.channel_id],
                    record.log_time,
                    record.data,
                    record.publish_time,
                    record.sequence,
                )
            elif isinstance(record, Attachment):
                writer.add_attachment(
                    record.create_time, record.log_time, record.name, record.media_type, record.data
                )
            elif isinstance(record, Metadata):
                writer.add_metadata(record.name, record.metadata)
        writer.finish()


def _register(
    writer: Writer, channel: Channel, content: _Content, schemas: dict[tuple[str, str, bytes], int]
) -> int:
    """Register a channel; a schema that is damaged is taken from what graspbench itself writes."""
    schema = None
    if channel.schema_id in content.schemas:
        found = content.schemas[channel.schema_id]
        schema = (found.name, found.encoding, found.data)
    elif channel.schema_id and channel.topic in CHANNELS:
        schema = encoding_of(channel.topic)[1]
    if schema is not None and schema not in schemas:
        schemas[schema] = writer.register_schema(*schema)
    schema_id = 0 if schema is None else schemas[schema]
    return int(writer.register_channel(channel.topic, channel.message_encoding, schema_id, channel.metadata))


def _opened(output: Path) -> Any:
    try:
        return output.open("wb")
    except OSError as error:
        raise LogError(f"cannot write '{output}': {error.strerror}", path=str(output)) from error
