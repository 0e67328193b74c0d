"""Dual surface extraction: one node in each sheet of each cell, so that the net is a manifold.

The sheets of a cell are those of marching cubes: on a face whose corners are inside crosswise, the
inside corners are kept apart. All cells follow one rule, so the sheets fit together (Nielson, "Dual
marching cubes", 2004).
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled
from graspbench.errors import ReconstructionError
from graspbench.reconstruction.hull_fields import HullFields
from graspbench.reconstruction.narrow_band import CORNERS, FACES, NarrowBand, fill

EDGES = np.array(
    [[a, a | (1 << (2 - axis))] for axis in range(3) for a in range(8) if not a >> (2 - axis) & 1],
    dtype=np.int64,
)
"""Corners at the ends of a cell's edges, four along each axis, shape (12, 2)."""


class Sheets(NamedTuple):
    """How the border passes a cell, for all signs of its corners.

    Attributes:
        of_edge: The sheet that cuts each edge, -1 for none, shape (256, 12).
        counts: Number of sheets, shape (256,).
        pinching: Bit w is set where the inside corners of face w lie crosswise and one sheet passes
            between them twice, shape (256,).
    """

    of_edge: IntArray
    counts: IntArray
    pinching: IntArray


@lru_cache(maxsize=1)
def sheets() -> Sheets:
    """Return the table of all 256 cells."""
    table = Sheets(np.full((256, 12), -1), np.zeros(256, dtype=np.int64), np.zeros(256, dtype=np.int64))
    for signs in range(256):
        inside = [bool(signs >> corner & 1) for corner in range(8)]
        cut = [e for e in range(12) if inside[EDGES[e, 0]] != inside[EDGES[e, 1]]]
        joined: list[set[int]] = [{e} for e in cut]
        crosswise: list[tuple[int, int, int]] = []
        for way in range(6):
            on_face = [e for e in cut if all(FACES[way] >> corner & 1 for corner in EDGES[e])]
            pairs = [on_face] if len(on_face) == 2 else []
            if len(on_face) == 4:
                corners = [c for c in range(8) if FACES[way] >> c & 1 and inside[c]]
                pairs = [[e for e in on_face if corner in EDGES[e]] for corner in corners]
                crosswise.append((way, pairs[0][0], pairs[1][0]))
            for first, second in pairs:
                both = [group for group in joined if first in group or second in group]
                joined = [group for group in joined if group not in both] + [set[int]().union(*both)]
        for number, group in enumerate(sorted(joined, key=min)):
            table.of_edge[signs, sorted(group)] = number
        table.counts[signs] = len(joined)
        for way, first, second in crosswise:
            if table.of_edge[signs, first] == table.of_edge[signs, second]:
                table.pinching[signs] |= 1 << way
    return table


@dataclass(frozen=True, eq=False)
class DualNet:
    """A closed net of quadrilaterals with nodes in the cells of a grid.

    Attributes:
        points: Nodes in the world, shape (n, 3).
        quads: Quadrilaterals, counter-clockwise seen from outside, shape (m, 4).
        crossings: Where the border cuts the edge of the grid that each quadrilateral is spanned around,
            shape (m, 3).
    """

    points: FloatArray
    quads: IntArray
    crossings: FloatArray


def extract_net(fields: HullFields, band: NarrowBand) -> DualNet:
    """Return the net of the largest connected surface in a band.

    Where two sheets of neighbouring cells would share a side twice, a corner is filled between them first, so
    that the net is a manifold. Silhouettes that cross at random leave islands, which are dropped.

    Args:
        fields: The visual hull's.
        band: Cells that its border passes.

    Returns:
        Nodes lie where the border cuts the edges of their cells on average.

    Raises:
        ReconstructionError: The border passes no cell.
    """
    table = sheets()
    while len(corners := _pinched_corners(band, table)):
        band = fill(fields, band, corners)
    first = np.concatenate(([0], np.cumsum(table.counts[band.signs])))
    quads, crossings = np.empty((3 * len(band.cells), 4), dtype=np.int64), np.empty((3 * len(band.cells), 3))
    count = _span(
        band.values, band.cells, band.signs, band.slots, first, table.of_edge, EDGES, quads, crossings
    )
    if count == 0:
        raise ReconstructionError(
            "the silhouettes have no point in common",
            remedy="check the camera calibration and that the object did not move",
        )
    quads, crossings = quads[:count], band.low + band.side_m * crossings[:count]
    size = int(first[-1])
    name = np.empty(size, dtype=np.int64)
    largest = _label(quads, name)
    kept = name[quads[:, 0]] == largest
    if not kept.all():
        number = np.cumsum(name == largest) - 1
        quads, crossings, size = number[quads[kept]], crossings[kept], int(number[-1]) + 1
    return DualNet(node_means(quads, crossings, size), quads, crossings)


def _pinched_corners(band: NarrowBand, table: Sheets) -> IntArray:
    """Return the outside corners of faces through which the same two sheets pass twice, shape (n, 3)."""
    found = []
    for a in np.flatnonzero(table.pinching[band.signs]):
        for way in range(1, 6, 2):
            beyond = band.cells[a].copy()
            beyond[way >> 1] += 1
            b = int(band.slots[tuple(beyond)])
            here, there = table.pinching[band.signs[a]], table.pinching[band.signs[b]]
            if here >> way & 1 and there >> (way - 1) & 1:
                outside = FACES[way] & ~int(band.signs[a])
                found += [band.cells[a] + CORNERS[c] for c in range(8) if outside >> c & 1]
    return np.array(found, dtype=np.int64).reshape(-1, 3)


@compiled
def _label(quads: IntArray, name: IntArray) -> int:
    """Name the connected part that each node belongs to; return the name of the one with most sides."""
    for n in range(len(name)):
        name[n] = n
    for f in range(len(quads)):
        for k in range(1, 4):
            a, b = quads[f, 0], quads[f, k]
            while name[a] != a:
                name[a] = name[name[a]]
                a = name[a]
            while name[b] != b:
                name[b] = name[name[b]]
                b = name[b]
            name[max(a, b)] = min(a, b)
    sizes = np.zeros(len(name), dtype=np.int64)
    for n in range(len(name)):
        # A name is never larger than the node's number, so those before are final.
        name[n] = name[name[n]]
        sizes[name[n]] += 1
    return int(sizes.argmax())


def node_means(quads: IntArray, crossings: FloatArray, size: int) -> FloatArray:
    """Return the mean of the crossings of each node's quadrilaterals, shape (size, 3)."""
    points = np.zeros((size, 3))
    _average(quads, crossings, points)
    return points


@compiled
def _average(quads: IntArray, crossings: FloatArray, points: FloatArray) -> None:
    number = np.zeros(len(points))
    for f in range(len(quads)):
        for k in range(4):
            n = quads[f, k]
            number[n] += 1.0
            for x in range(3):
                points[n, x] += crossings[f, x]
    for n in range(len(points)):
        for x in range(3):
            points[n, x] /= number[n]


@compiled
def _span(
    values: npt.NDArray[np.float32],
    cells: IntArray,
    signs: IntArray,
    slots: npt.NDArray[np.int32],
    first: IntArray,
    sheet_of_edge: IntArray,
    edges: IntArray,
    quads: IntArray,
    crossings: FloatArray,
) -> int:
    """Span a quadrilateral between the nodes of the four cells around each edge that the border cuts."""
    count = 0
    ring = np.empty(4, dtype=np.int64)
    for a in range(len(cells)):
        for axis in range(3):
            # The cell's last edge along the axis: the other three cells around it come later in the grid.
            e = 4 * axis + 3
            s = sheet_of_edge[signs[a], e]
            if s < 0:
                continue
            i, j, k = cells[a, 0], cells[a, 1], cells[a, 2]
            # Counter-clockwise about the axis: the cell, and its neighbours along the next two axes.
            for n in range(4):
                first_up, second_up = n == 1 or n == 2, n >= 2
                if axis == 0:
                    p, q, r = i, j + first_up, k + second_up
                elif axis == 1:
                    p, q, r = i + second_up, j, k + first_up
                else:
                    p, q, r = i + first_up, j + second_up, k
                b = slots[p, q, r]
                # Its edge on the same line of the grid.
                low_first, low_second = 0 if first_up else 1, 0 if second_up else 1
                if axis == 0:
                    corner = low_first << 1 | low_second
                elif axis == 1:
                    corner = low_second << 2 | low_first
                else:
                    corner = low_first << 2 | low_second << 1
                own = -1
                for f in range(4 * axis, 4 * axis + 4):
                    if edges[f, 0] == corner:
                        own = f
                ring[n] = first[b] + sheet_of_edge[signs[b], own]
            inside = (signs[a] >> edges[e, 0]) & 1 == 1
            if not inside:
                ring[1], ring[3] = ring[3], ring[1]
            for n in range(4):
                quads[count, n] = ring[n]
            u = values[i + (axis != 0), j + (axis != 1), k + (axis != 2)]
            t = u / (u - values[i + 1, j + 1, k + 1])
            crossings[count, 0] = i + (t if axis == 0 else 1.0)
            crossings[count, 1] = j + (t if axis == 1 else 1.0)
            crossings[count, 2] = k + (t if axis == 2 else 1.0)
            count += 1
    return count
