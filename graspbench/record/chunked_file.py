"""An MCAP file that is useful even when its writer is killed."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import Writer
from mcap_protobuf.schema import build_file_descriptor_set

from graspbench.record.channels import CHANNELS

_SCORES = "graspbench.Scores"
_SCORES_SCHEMA = {"type": "object", "additionalProperties": {"type": ["number", "boolean", "string", "null"]}}


class ChunkedFile:
    """Writes messages into ``*.mcap.partial`` and gives it its name when it is finished.

    What was written before `end_chunk` is with the operating system: a killed process does not lose it.

    Args:
        path: The file's final name; its folder exists.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._partial = path.with_name(path.name + ".partial")
        self._stream = self._partial.open("wb")
        self._writer = Writer(self._stream)
        self._writer.start(profile="", library="graspbench")
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}

    def add(self, topic: str, message: Any, time_ns: int) -> None:
        """Add a protobuf message, or bytes of JSON, to a topic of `CHANNELS`."""
        data = message if isinstance(message, bytes) else message.SerializeToString()
        self._writer.add_message(self._channel(topic), time_ns, data, time_ns)

    def metadata(self, name: str, values: Mapping[str, object]) -> None:
        """Add key-value pairs."""
        self._writer.add_metadata(name, {key: str(value) for key, value in values.items()})

    def attach(self, name: str, text: str, media_type: str, time_ns: int) -> None:
        """Add a whole text."""
        self._writer.add_attachment(0, time_ns, name, media_type, text.encode())

    def end_chunk(self) -> None:
        """Hand everything so far to the operating system."""
        self._writer.flush()

    def finish(self) -> None:
        """Write the index and give the file its name."""
        self._writer.finish()
        self._stream.close()
        os.replace(self._partial, self._path)

    def abandon(self) -> None:
        """Close the file as it is, under its partial name."""
        self._stream.close()

    def _channel(self, topic: str) -> int:
        if topic not in self._channels:
            encoding, schema = encoding_of(topic)
            if schema[0] not in self._schemas:
                self._schemas[schema[0]] = self._writer.register_schema(*schema)
            self._channels[topic] = self._writer.register_channel(
                topic, encoding, self._schemas[schema[0]], {"description": CHANNELS[topic].description}
            )
        return self._channels[topic]


def encoding_of(topic: str) -> tuple[str, tuple[str, str, bytes]]:
    """Return how messages of a topic of `CHANNELS` are written, and their schema: name, encoding, data."""
    channel = CHANNELS[topic]
    if channel.message is None:
        return MessageEncoding.JSON, (_SCORES, SchemaEncoding.JSONSchema, json.dumps(_SCORES_SCHEMA).encode())
    descriptors = build_file_descriptor_set(channel.message)
    data = descriptors.SerializeToString(deterministic=True)
    return MessageEncoding.Protobuf, (channel.message.DESCRIPTOR.full_name, SchemaEncoding.Protobuf, data)
