"""Coarse-to-fine carving: the hull's signed distance at the corners of cells near its border only."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from graspbench.arrays import FloatArray, IntArray
from graspbench.compiled import compiled, inner
from graspbench.reconstruction.hull_fields import (
    STEEPEST,
    HullFields,
    critical_view_near,
    unseen,
    view_distance,
    view_slope,
)

SLACK = 0.75
"""Share of the distance in the images that the border is surely away: perspective stretches distances."""

BLOCK_CELLS = 4
"""Cells along each side of a block of the first look."""

APPROACHES = 3
"""Steps from a block's centre to the border."""

BARELY_M = 1e-6
"""Distance to the border of a corner whose side is decided otherwise."""

NEAR_SHARE = 0.2
"""A point this share of a cell off the border has reached it."""

BYTES_PER_CELL = 16
"""Memory of a grid: distances and slots, twice while corners are filled."""

CORNERS = np.array([[i, j, k] for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=np.int64)
"""Corners of a cell; corner c stands for bit c of a cell's signs, shape (8, 3)."""

FACES = np.array([sum(1 << c for c in range(8) if CORNERS[c, w >> 1] == w & 1) for w in range(6)])
"""Bits of the corners of a cell's faces, low and high along each axis in turn, shape (6,)."""


@dataclass(frozen=True, eq=False)
class NarrowBand:
    """Cells of a regular grid that the hull's border passes, and the distances at their corners.

    Attributes:
        low: Corner (0, 0, 0) in the world, shape (3,).
        side_m: Side of a cell.
        values: Signed distances (m) at the grid's corners, positive outside (there to some view's border, not
            the farthest); NaN where nobody looked,
            shape (nx + 1, ny + 1, nz + 1).
        cells: Cells with corners on both sides, shape (n, 3).
        signs: Bit c is set where corner c of a cell is inside, shape (n,).
        slots: Row of each cell in `cells`, -1 where the border does not pass, shape (nx, ny, nz).
    """

    low: FloatArray
    side_m: float
    values: npt.NDArray[np.float32]
    cells: IntArray
    signs: IntArray
    slots: npt.NDArray[np.int32]


def carve(fields: HullFields, low: FloatArray, high: FloatArray, side_m: float) -> NarrowBand:
    """Find the cells that the border of a visual hull passes.

    A coarse look finds the blocks that the border may pass; from each of them the border is approached, and
    then followed from cell to cell.

    Args:
        fields: The visual hull's.
        low: Lower corner of a box that holds it, shape (3,).
        high: Upper corner, shape (3,).
        side_m: Side of a cell.
    """
    corner, blocks = grid_of(low, high, side_m)
    shape = blocks * BLOCK_CELLS
    values = np.full(shape + 1, np.nan, dtype=np.float32)
    seeds = np.empty((int(blocks.prod()), 3), dtype=np.int64)
    number = _approach(fields, corner, side_m, blocks, seeds)
    return _collect(fields, corner, side_m, values, seeds[:number])


def grid_of(low: FloatArray, high: FloatArray, side_m: float) -> tuple[FloatArray, IntArray]:
    """Return the lower corner of the grid over a box, and how many blocks it has along each axis.

    Args:
        low: Lower corner of the box, shape (3,).
        high: Upper corner, shape (3,).
        side_m: Side of a cell; a block has `BLOCK_CELLS` of them along each axis.
    """
    block = side_m * BLOCK_CELLS
    # One cell of margin on each side; a whole number of blocks.
    blocks = np.ceil((high - low + 2.0 * side_m) / block).astype(np.int64)
    return 0.5 * (low + high) - 0.5 * block * blocks, blocks


def fill(fields: HullFields, band: NarrowBand, corners: IntArray) -> NarrowBand:
    """Return the band after some corners, shape (n, 3), that are outside were put just inside the border."""
    values = band.values.copy()
    values[corners[:, 0], corners[:, 1], corners[:, 2]] = -BARELY_M
    return _collect(fields, band.low, band.side_m, values, band.cells)


def _collect(
    fields: HullFields, low: FloatArray, side_m: float, values: npt.NDArray[np.float32], seeds: IntArray
) -> NarrowBand:
    """Follow the border from the seeds on."""
    slots = np.full(np.array(values.shape) - 1, -1, dtype=np.int32)
    cells, signs = np.empty((2048, 3), dtype=np.int64), np.empty(2048, dtype=np.int64)
    pending = np.empty(2048, dtype=np.int64)
    seed = count = left = 0
    while True:
        count, left, seed = _follow(
            fields, low, side_m, seeds, seed, values, slots, cells, signs, pending, count, left
        )
        if seed >= len(seeds) and left == 0:
            return NarrowBand(low, side_m, values, cells[:count], signs[:count], slots)
        cells, signs = np.concatenate((cells, cells)), np.concatenate((signs, signs))
        pending = np.concatenate((pending, pending))


@compiled
def _approach(fields: HullFields, low: FloatArray, side: float, blocks: IntArray, seeds: IntArray) -> int:
    """Find a cell on the border near the centre of each block that the border may pass; return how many."""
    block = BLOCK_CELLS * side
    reach = 0.5 * np.sqrt(3.0) * block / SLACK
    count, seen = 0, unseen(fields)
    for i in range(blocks[0]):
        for j in range(blocks[1]):
            for k in range(blocks[2]):
                x = low[0] + (i + 0.5) * block
                y = low[1] + (j + 0.5) * block
                z = low[2] + (k + 0.5) * block
                view, distance = critical_view_near(fields, x, y, z, seen)
                if abs(distance) > reach:
                    continue
                for _ in range(APPROACHES):
                    _, gx, gy, gz = view_slope(fields, view, x, y, z)
                    x, y, z = x - distance * gx, y - distance * gy, z - distance * gz
                    view, distance = critical_view_near(fields, x, y, z, seen)
                    if abs(distance) < NEAR_SHARE * side:
                        break
                seeds[count, 0] = int(np.floor((x - low[0]) / side))
                seeds[count, 1] = int(np.floor((y - low[1]) / side))
                seeds[count, 2] = int(np.floor((z - low[2]) / side))
                count += 1
    return count


@inner
def _side_of_border(fields: HullFields, x: float, y: float, z: float, seen: FloatArray) -> float:
    """Return a point's signed distance (m) to the hull; outside, that to the first view that excludes it.

    Only the sign counts there, and the view that excluded the last point mostly excludes the next one. Views
    that cannot matter yet are not looked at again; ``seen`` is as for `critical_view_near`.
    """
    count = len(fields.starts)
    largest = fields.ground_m - z
    if largest > 0.0:
        return largest
    first = int(seen[count, 0])
    for turn in range(count + 1):
        view = first if turn == 0 else turn - 1
        if view == count or (turn > 0 and view == first):
            continue
        room = largest - seen[view, 3]
        if room > 0.0:
            way = (x - seen[view, 0]) ** 2 + (y - seen[view, 1]) ** 2 + (z - seen[view, 2]) ** 2
            if room * room > STEEPEST * STEEPEST * way:
                continue
        distance = view_distance(fields, view, x, y, z)
        seen[view, 0], seen[view, 1], seen[view, 2], seen[view, 3] = x, y, z, distance
        if distance > 0.0:
            seen[count, 0] = view
            return distance
        largest = max(largest, distance)
    return largest


@inner
def _look(
    fields: HullFields,
    low: FloatArray,
    side: float,
    i: int,
    j: int,
    k: int,
    values: npt.NDArray[np.float32],
    seen: FloatArray,
) -> int:
    """Make sure that a cell's corners are known; return its signs."""
    signs = 0
    for c in range(8):
        p, q, r = i + (c >> 2), j + ((c >> 1) & 1), k + (c & 1)
        if np.isnan(values[p, q, r]):
            on_border = (
                p == 0
                or q == 0
                or r == 0
                or p == values.shape[0] - 1
                or q == values.shape[1] - 1
                or r == values.shape[2] - 1
            )
            distance = _side_of_border(fields, low[0] + p * side, low[1] + q * side, low[2] + r * side, seen)
            # The box holds the hull: what sticks out of it is cut, so that the surface stays closed.
            values[p, q, r] = max(distance, BARELY_M) if on_border else distance
        if values[p, q, r] < 0.0:
            signs |= 1 << c
    return signs


@compiled
def _follow(
    fields: HullFields,
    low: FloatArray,
    side: float,
    seeds: IntArray,
    seed: int,
    values: npt.NDArray[np.float32],
    slots: npt.NDArray[np.int32],
    cells: IntArray,
    signs: IntArray,
    pending: IntArray,
    count: int,
    left: int,
) -> tuple[int, int, int]:
    """Collect the cells with corners on both sides, from the seeds on and from each to its neighbours.

    The last cell found goes on first, so that cells that follow each other lie side by side: most of what the
    views said of one holds for the next. Ends when all is done or the arrays are full.

    Returns:
        Cells found, cells whose neighbours are still to be looked at, and seeds used.
    """
    seen = unseen(fields)
    while True:
        while left > 0:
            if count + 6 > len(cells):
                return count, left, seed
            left -= 1
            here = pending[left]
            for way in range(6):
                axis, up = way >> 1, way & 1
                i = cells[here, 0] + (2 * up - 1) * (axis == 0)
                j = cells[here, 1] + (2 * up - 1) * (axis == 1)
                k = cells[here, 2] + (2 * up - 1) * (axis == 2)
                if not _is_cell(slots, i, j, k) or slots[i, j, k] >= 0:
                    continue
                # A face between two cells whose corners are on both sides leads on to the next cell.
                face = signs[here] & FACES[way]
                if face != 0 and face != FACES[way]:
                    slots[i, j, k] = count
                    cells[count, 0], cells[count, 1], cells[count, 2] = i, j, k
                    signs[count] = _look(fields, low, side, i, j, k, values, seen)
                    pending[left] = count
                    left += 1
                    count += 1
        if seed == len(seeds):
            return count, left, seed
        if count + 6 > len(cells):
            return count, left, seed
        i, j, k = seeds[seed, 0], seeds[seed, 1], seeds[seed, 2]
        seed += 1
        if not _is_cell(slots, i, j, k) or slots[i, j, k] >= 0:
            continue
        found = _look(fields, low, side, i, j, k, values, seen)
        if found != 0 and found != 255:
            slots[i, j, k] = count
            cells[count, 0], cells[count, 1], cells[count, 2] = i, j, k
            signs[count] = found
            pending[left] = count
            left += 1
            count += 1


@inner
def _is_cell(slots: npt.NDArray[np.int32], i: int, j: int, k: int) -> bool:
    inside: bool = 0 <= i < slots.shape[0] and 0 <= j < slots.shape[1] and 0 <= k < slots.shape[2]
    return inside
