"""YAML that somebody else may have written: read as plain values, or refused in one sentence."""

import math
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import yaml

from graspbench.errors import ConfigurationError, sentence, shown

MAX_FILE_BYTES = 4 << 20
MAX_VALUES = 100_000
MAX_DEPTH = 40
_MAX_SAID = 160
_MAX_WHOLE = 2**64


class _PlainLoader(yaml.SafeLoader):
    """Reads plain values; refuses a key that stands twice."""

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        seen: set[str] = set()
        for key, _ in node.value:
            text = str(key.value)
            if text in seen and text != "<<":
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key '{text[:40]}' stands twice", key.start_mark
                )
            seen.add(text)
        return super().construct_mapping(node, deep)


def read_yaml(path: Path) -> Any:
    """Read a YAML file as plain values; one that has not changed is not parsed again.

    Raises:
        ConfigurationError: It is no regular file, no UTF-8, no YAML, too large, or has a key twice.
    """
    try:
        if not path.is_file():
            raise ConfigurationError(f"there is no file {path}", remedy="correct its path")
        stamp = path.stat()
        if stamp.st_size > MAX_FILE_BYTES:
            raise ConfigurationError(
                f"{path} is too large for a configuration ({stamp.st_size >> 20} MB)",
                remedy=f"at most {MAX_FILE_BYTES >> 20} MB are read",
            )
        return _read(path, stamp.st_mtime_ns, stamp.st_size)
    except OSError as error:
        raise ConfigurationError(
            f"{path} cannot be read ({error.strerror or error})", remedy="check the file and its permissions"
        ) from error


@lru_cache(maxsize=1024)
def _read(path: Path, _modified_ns: int, _size: int) -> Any:
    try:
        with path.open("rb") as stream:
            text = stream.read(MAX_FILE_BYTES + 1).decode("utf-8")
    except UnicodeDecodeError as error:
        raise ConfigurationError(
            f"{path} is not UTF-8 (byte {error.start})", remedy="save it as UTF-8 text"
        ) from error
    return parse_yaml(text, str(path))


def parse_yaml(text: str, where: str) -> Any:
    """Return the plain values of a YAML document.

    Args:
        text: The document.
        where: What to call it in a sentence.

    Raises:
        ConfigurationError: It is no YAML, has a key twice, or is much larger than it looks.
    """
    try:
        loader = _PlainLoader(text)
        try:
            node = loader.get_single_node()
            if node is None:
                return None
            if _unfolded(node, {}, 0) > MAX_VALUES:
                raise ConfigurationError(
                    f"{where} unfolds to more than {MAX_VALUES} values or to endless ones",
                    remedy="write fewer anchors and aliases",
                )
            content = loader.construct_document(node)
        finally:
            loader.dispose()
    except yaml.YAMLError as error:
        raise ConfigurationError(
            f"{where} is no YAML that can be used ({_said(error)})", remedy="correct the file"
        ) from error
    except RecursionError as error:
        raise ConfigurationError(f"{where} is nested too deeply", remedy="correct the file") from error
    except (ValueError, OverflowError, TypeError) as error:
        raise ConfigurationError(
            f"{where} holds a value that cannot be read ({sentence(str(error), _MAX_SAID)})",
            remedy="correct the file",
        ) from error
    return content


def check_plain(content: Any, where: str) -> None:
    """Refuse what is no plain configuration: bytes, dates, keys of other kinds, endless or broken text.

    Raises:
        ConfigurationError: The message names the first such value.
    """
    for count, (key, value, depth) in enumerate(_walk(content, where), start=1):
        if count > MAX_VALUES or depth > MAX_DEPTH:
            raise ConfigurationError(
                f"{where} is nested too deeply or holds more than {MAX_VALUES} values", remedy="correct it"
            )
        if isinstance(value, str) and not _is_text(value):
            raise ConfigurationError(f"{key} = {shown(value)} is no valid text", remedy="write it as UTF-8")
        if not isinstance(value, str | int | float | list | tuple | dict | None) or _is_endless(value):
            raise ConfigurationError(
                f"{key} = {shown(value)} cannot be used", remedy="give text, a number, a list or a mapping"
            )


def _walk(content: Any, where: str) -> Iterator[tuple[str, Any, int]]:
    """Yield every value with its key and depth; keys of mappings are values too."""
    waiting: list[tuple[str, Any, int]] = [(where, content, 0)]
    while waiting:
        key, value, depth = waiting.pop()
        yield key, value, depth
        if depth > MAX_DEPTH:
            return
        if isinstance(value, dict):
            for name, item in value.items():
                plain = isinstance(name, str | int) and not _is_endless(name)
                below = f"{key}.{sentence(str(name), 60)}" if plain else key
                if isinstance(name, str) and not _is_text(name):
                    yield key, name, depth
                if not plain and name is not None:
                    yield key, _Odd(name), depth
                waiting.append((below, item, depth + 1))
        elif isinstance(value, list | tuple):
            waiting += [(key, item, depth + 1) for item in value]


class _Odd:
    """A key that no configuration has."""

    def __init__(self, key: object) -> None:
        self._key = key

    def __repr__(self) -> str:
        return f"a key {shown(self._key)}"


def _is_endless(value: object) -> bool:
    """Tell a whole number that no option takes: one of thousands of digits cannot even be printed."""
    return isinstance(value, int) and not -_MAX_WHOLE < value < _MAX_WHOLE


def _is_text(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return "\x00" not in text


def _unfolded(node: Any, known: dict[int, float], depth: int) -> float:
    """Return how many values a node holds, each alias counted as what it stands for."""
    if depth > MAX_DEPTH:
        return math.inf
    if id(node) in known:
        return known[id(node)]
    known[id(node)] = math.inf  # of one that holds itself
    count = 1.0
    if isinstance(node, yaml.SequenceNode):
        count += sum(_unfolded(item, known, depth + 1) for item in node.value)
    elif isinstance(node, yaml.MappingNode):
        count += sum(_unfolded(item, known, depth + 1) for pair in node.value for item in pair)
    known[id(node)] = count
    return count


def _said(error: yaml.YAMLError) -> str:
    """Return what is wrong and in which line, of an error that takes several lines to say it."""
    problem = getattr(error, "problem", None) or str(error)
    mark = getattr(error, "problem_mark", None)
    line = f", line {mark.line + 1}" if mark is not None else ""
    return sentence(" ".join(str(problem).split()), _MAX_SAID) + line
