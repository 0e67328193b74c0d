"""A solid body: its surface and the convex parts that stand for it in contact dynamics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True)
class Body:
    """What a generator or a file yields, in metres, in the frame it was described in.

    Attributes:
        mesh: One closed surface, outward normals.
        parts: Convex pieces whose union is the body; None when nobody knows them yet.
        repairs: What was changed to make the body usable, one sentence each.
        warnings: What the reader should know but nothing was done about, one sentence each.
    """

    mesh: trimesh.Trimesh
    parts: tuple[trimesh.Trimesh, ...] | None
    repairs: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
