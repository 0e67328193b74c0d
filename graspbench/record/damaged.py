"""The records of an MCAP file that may be cut or damaged: all that is readable, and what is not.

A record that cannot be read is stepped over; where even its length is wrong, the next chunk is sought.
"""

import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, McapRecord, MessageIndex, Metadata, Schema
from mcap.stream_reader import breakup_chunk

from graspbench.errors import LogError

_MAGIC = b"\x89MCAP0\r\n"
_HEAD_BYTES = 9
_MAX_RECORD_BYTES = 1 << 30
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
# How a chunk's head goes on after opcode and length: two times, a size, a checksum, then this.
_COMPRESSIONS = (b"\x04\x00\x00\x00zstd", b"\x03\x00\x00\x00lz4")
_BEFORE_COMPRESSION = _HEAD_BYTES + 8 + 8 + 8 + 4
_SEARCH_BYTES = 1 << 20

_READERS: dict[int, Callable[[ReadDataStream], McapRecord]] = {
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.CHUNK: Chunk.read,
    Opcode.MESSAGE_INDEX: MessageIndex.read,
    Opcode.ATTACHMENT: Attachment.read,
    Opcode.METADATA: Metadata.read,
}


@dataclass
class Damage:
    """What of a file could not be read; filled while it is.

    Attributes:
        chunks: Chunks whose checksum or compression is broken.
        messages: Messages in them by channel id, as far as the index tells.
        records: Other records that are broken.
        skipped_bytes: Bytes that make no record.
        ended: Whether the file ends as it should.
    """

    chunks: int = 0
    messages: Counter[int] = field(default_factory=Counter)
    records: int = 0
    skipped_bytes: int = 0
    ended: bool = False

    @property
    def none(self) -> bool:
        """Whether the file is whole."""
        return self.ended and not (self.chunks or self.records or self.skipped_bytes)


def read_records(path: Path, damage: Damage) -> Iterator[McapRecord]:
    """Yield schemas, channels, messages, attachments and metadata in order, those of the summary too.

    Args:
        path: ``*.mcap`` or ``*.mcap.partial``.
        damage: Where to note what cannot be read.

    Raises:
        LogError: There is no such file, or it is no MCAP file.
    """
    try:
        if path.exists() and not path.is_file():
            raise LogError(f"the log '{path}' is no regular file", path=str(path))
        stream = path.open("rb")
    except OSError as error:
        raise LogError(f"cannot read log '{path}': {error.strerror}", path=str(path)) from error
    with stream:
        if stream.read(len(_MAGIC)) != _MAGIC:
            raise LogError(
                f"'{path}' is no MCAP file", remedy="give a *.mcap or *.mcap.partial file", path=str(path)
            )
        yield from _after_magic(stream, path.stat().st_size, damage)


def _after_magic(stream: BinaryIO, size: int, damage: Damage) -> Iterator[McapRecord]:
    in_damaged_chunk = False
    while (at := stream.tell()) < size:
        head = stream.read(_HEAD_BYTES)
        opcode, length = head[0], int.from_bytes(head[1:], "little")
        if opcode == Opcode.FOOTER and _ends(stream, at, length, size):
            damage.ended = True
            return
        end = at + _HEAD_BYTES + length
        known = Opcode.HEADER <= opcode <= Opcode.DATA_END
        if len(head) < _HEAD_BYTES or not known or length > _MAX_RECORD_BYTES or end > size:
            _seek_chunk(stream, at, size, damage)
            continue
        payload = stream.read(length)
        record, whole = _record(opcode, payload)
        if opcode == Opcode.CHUNK and not whole:
            damage.chunks += 1
            _seek_chunk(stream, at, size, damage)
        elif isinstance(record, Chunk):
            inner = _opened(record)
            in_damaged_chunk = inner is None
            damage.chunks += in_damaged_chunk
            yield from inner or ()
        elif isinstance(record, MessageIndex):
            if in_damaged_chunk:
                damage.messages[record.channel_id] += len(record.records)
        elif record is not None:
            yield record
        elif not whole:
            damage.records += 1


def _ends(stream: BinaryIO, at: int, length: int, size: int) -> bool:
    """Tell whether a footer at this place is that of the file."""
    end = at + _HEAD_BYTES + length
    if end + len(_MAGIC) != size:
        return False
    stream.seek(end)
    found = stream.read(len(_MAGIC)) == _MAGIC
    stream.seek(at + _HEAD_BYTES)
    return found


def _record(opcode: int, payload: bytes) -> tuple[McapRecord | None, bool]:
    """Return a record and whether it is whole; None and True for one that carries nothing of use."""
    reader = _READERS.get(opcode)
    if reader is None:
        return None, True
    if opcode == Opcode.ATTACHMENT and zlib.crc32(payload[:-4]) != int.from_bytes(payload[-4:], "little"):
        return None, False
    stream = ReadDataStream(BytesIO(payload))
    try:
        record = reader(stream)
    except Exception:  # damaged bytes raise errors of any kind in the decoders
        return None, False
    return (record, True) if stream.count == len(payload) else (None, False)


def _opened(chunk: Chunk) -> Sequence[McapRecord] | None:
    """Return the records of a chunk; None when it is damaged, the next ones may be whole."""
    if chunk.uncompressed_size > _MAX_RECORD_BYTES:
        return None
    if chunk.data.startswith(_ZSTD_MAGIC):
        chunk.compression = "zstd"  # whatever is left of the word
    try:
        records: Sequence[McapRecord] = breakup_chunk(chunk, validate_crc=True)
    except Exception:
        return None
    return records


def _seek_chunk(stream: BinaryIO, at: int, size: int, damage: Damage) -> None:
    """Go on at the next chunk after a place where no record can be read, or at the file's end."""
    found = next((place for place in _chunk_heads(stream, at + 1) if place > at), size)
    damage.skipped_bytes += found - at
    stream.seek(found)


def _chunk_heads(stream: BinaryIO, start: int) -> Iterator[int]:
    """Yield the places after ``start`` that look like the beginning of a chunk."""
    offset = start
    overlap = _BEFORE_COMPRESSION + max(map(len, _COMPRESSIONS))
    while True:
        stream.seek(offset)
        window = stream.read(_SEARCH_BYTES + overlap)
        places = sorted(place for word in _COMPRESSIONS for place in _all_places(window, word))
        for place in places:
            head = place - _BEFORE_COMPRESSION
            if 0 <= head < _SEARCH_BYTES and window[head] == Opcode.CHUNK:
                yield offset + head
        if len(window) < _SEARCH_BYTES + overlap:
            return
        offset += _SEARCH_BYTES


def _all_places(text: bytes, word: bytes) -> Iterator[int]:
    at = text.find(word)
    while at >= 0:
        yield at
        at = text.find(word, at + 1)
