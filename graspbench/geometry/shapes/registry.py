"""What a kind of shape is, and how a description becomes one."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol, TypeVar

from pydantic import ConfigDict, TypeAdapter, ValidationError

from graspbench.errors import ConfigurationError
from graspbench.geometry.body import Body
from graspbench.registry import Registry


class Shape(Protocol):
    """Parameters of one kind of shape: a frozen dataclass that can build itself."""

    def build(self) -> Body:
        """Return the body, z axis up.

        Raises:
            ConfigurationError: The numbers do not fit each other.
            MeshError: The shape comes from a file that cannot be used.
        """


SHAPES: Registry[type[Shape]] = Registry("shape", "graspbench.geometry.shapes")

S = TypeVar("S")


def register(kind: str) -> Callable[[type[S]], type[S]]:
    """Return a decorator that makes a dataclass known as ``shape: {kind: ...}``; unknown keys are errors."""

    def decorate(shape: type[S]) -> type[S]:
        shape.__pydantic_config__ = ConfigDict(extra="forbid")  # type: ignore[attr-defined]
        SHAPES.register(kind)(shape)  # type: ignore[arg-type]
        return shape

    return decorate


def make_shape(description: Mapping[str, Any]) -> Shape:
    """Return the shape that ``{kind: ..., <parameters>}`` describes.

    Raises:
        ConfigurationError: The kind or a parameter is unknown, of the wrong type or out of range.
    """
    values = {str(key): value for key, value in description.items()}
    kind = values.pop("kind", None)
    if kind is None:
        raise ConfigurationError(
            "a shape's description has no kind", remedy=f"add one of {', '.join(SHAPES)}"
        )
    shape = SHAPES[str(kind)]
    try:
        return TypeAdapter(shape).validate_python(values)
    except ValidationError as error:
        raise ConfigurationError(
            f"shape '{kind}': {describe_first(error)}",
            remedy=f"its parameters are {', '.join(sorted(_fields(shape)))}",
            kind=kind,
        ) from None


def describe_first(error: ValidationError) -> str:
    """Return pydantic's first complaint as a clause that names the key."""
    first = error.errors(include_url=False)[0]
    key = ".".join(str(part) for part in first["loc"])
    if first["type"] in ("unexpected_keyword_argument", "extra_forbidden"):
        return f"unknown parameter '{key}'"
    message = first["msg"][:1].lower() + first["msg"][1:]
    return f"{key} = {first['input']!r}: {message}"


def _fields(shape: type[Any]) -> tuple[str, ...]:
    return tuple(getattr(shape, "__dataclass_fields__", {}))
