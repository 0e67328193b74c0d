"""Compiled exact test whether a hand sinks into a surface of triangles, rather than into its points only."""

import math
from typing import NamedTuple

import numpy as np

from graspbench.arrays import BoolArray, FloatArray, IntArray, cross
from graspbench.compiled import compiled, inner
from graspbench.hand.borders import cuts_hull
from graspbench.hand.chains import Chains
from graspbench.hand.collision import place_hand
from graspbench.hand.distance import ITERATIONS, Point, lowest_in_core, nearest_in_core
from graspbench.hand.obstacle import balls_around, near_together
from graspbench.hand.shapes import BOUND, FINGER, IS_TIP, KIND, PLANES, RADIUS, Shapes
from graspbench.hand.task import System

DEPTH_M = 9e-5  # deeper is a collision: a little less than the 0.1 mm that are tolerated
TOUCHING_M = 1e-6
BLOCK_TRIANGLES = 16


class Triangles(NamedTuple):
    """A surface in the world, in blocks of triangles that are near together.

    Attributes:
        corners: Shape (t, 3, 3), m.
        balls: Centres and radii of balls around them, shape (t, 4), m.
        planes: Unit normals and offsets of their planes, zero where a triangle has none, shape (t, 4).
        blocks: Centres and radii of balls around the blocks, shape (b, 4), m.
        starts: First triangle of each block, and t, shape (b + 1,).
    """

    corners: FloatArray
    balls: FloatArray
    planes: FloatArray
    blocks: FloatArray
    starts: IntArray


def triangles_of(points: FloatArray, faces: IntArray | None) -> Triangles:
    """Prepare a surface for the tests; without faces every point counts as a triangle of its own.

    Args:
        points: Shape (n, 3), m.
        faces: Shape (t, 3).
    """
    faces = np.repeat(np.arange(len(points))[:, None], 3, axis=1) if faces is None else faces
    if len(faces) == 0:
        nothing = np.zeros((0, 4))
        return Triangles(np.zeros((0, 3, 3)), nothing, nothing, nothing, np.zeros(1, dtype=np.int64))
    unordered = points[faces]
    order, starts = near_together(unordered.sum(axis=1), BLOCK_TRIANGLES)
    corners = unordered[order]
    centres = corners.sum(axis=1) / 3.0
    gaps = corners - centres[:, None]
    radii = np.sqrt(np.einsum("tij,tij->ti", gaps, gaps).max(axis=1))
    normals = cross(gaps[:, 1] - gaps[:, 0], gaps[:, 2] - gaps[:, 0])
    normals /= np.maximum(np.sqrt(np.einsum("ij,ij->i", normals, normals)), 1e-12)[:, None]
    return Triangles(
        corners=corners,
        balls=np.column_stack((centres, radii)),
        planes=np.column_stack((normals, np.einsum("ij,ij->i", normals, centres))),
        blocks=balls_around(corners.reshape(-1, 3), 3 * starts),
        starts=starts,
    )


@inner
def _nearest_in_triangle(corners: FloatArray, x: float, y: float, z: float) -> Point:
    """Return the point of a triangle nearest to (x, y, z) (Ericson 2005, 5.1.5)."""
    ux, uy, uz = corners[1, 0] - corners[0, 0], corners[1, 1] - corners[0, 1], corners[1, 2] - corners[0, 2]
    vx, vy, vz = corners[2, 0] - corners[0, 0], corners[2, 1] - corners[0, 1], corners[2, 2] - corners[0, 2]
    x, y, z = x - corners[0, 0], y - corners[0, 1], z - corners[0, 2]
    uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    xu, xv = x * ux + y * uy + z * uz, x * vx + y * vy + z * vz
    s = t = 0.0
    inside = uu * vv - uv * uv
    if inside > 1e-12 * uu * vv:
        s, t = (vv * xu - uv * xv) / inside, (uu * xv - uv * xu) / inside
    if inside <= 1e-12 * uu * vv or s < 0.0 or t < 0.0 or s + t > 1.0:
        # Nearest on the border: the best of the three edges.
        least = math.inf
        for edge in range(3):
            a = b = ga = gb = 0.0
            if edge == 0:
                a = min(1.0, max(0.0, xu / uu)) if uu > 0.0 else 0.0
            elif edge == 1:
                b = min(1.0, max(0.0, xv / vv)) if vv > 0.0 else 0.0
            else:
                square = uu - 2.0 * uv + vv
                b = min(1.0, max(0.0, (uu - uv - xu + xv) / square)) if square > 0.0 else 0.0
                a = 1.0 - b
            # Squared distance but for |x|^2.
            ga, gb = a * uu + b * uv - 2.0 * xu, a * uv + b * vv - 2.0 * xv
            if a * ga + b * gb < least:
                least, s, t = a * ga + b * gb, a, b
    return (
        corners[0, 0] + s * ux + t * vx,
        corners[0, 1] + s * uy + t * vy,
        corners[0, 2] + s * uz + t * vz,
    )


@compiled
def balls_sink(triangles: Triangles, centres: FloatArray, radius: float, out: BoolArray) -> None:
    """Tell which balls come nearer to a surface than their radius.

    Args:
        triangles: The surface.
        centres: Shape (n, 3).
        radius: The balls' radius.
        out: Output, shape (n,).
    """
    corners, balls, planes, blocks, starts = triangles
    for i in range(centres.shape[0]):
        x, y, z = centres[i, 0], centres[i, 1], centres[i, 2]
        out[i] = False
        for b in range(blocks.shape[0]):
            far = radius + blocks[b, 3]
            if (blocks[b, 0] - x) ** 2 + (blocks[b, 1] - y) ** 2 + (blocks[b, 2] - z) ** 2 >= far * far:
                continue
            for t in range(starts[b], starts[b + 1]):
                height = planes[t, 0] * x + planes[t, 1] * y + planes[t, 2] * z - planes[t, 3]
                # In its plane the triangle is within a disc: nothing of it is nearer than that.
                room = radius * radius - height * height
                if room <= 0.0:
                    continue
                aside = (balls[t, 0] - x) ** 2 + (balls[t, 1] - y) ** 2 + (balls[t, 2] - z) ** 2
                if aside - height * height >= (math.sqrt(room) + balls[t, 3]) ** 2:
                    continue
                p, q, r = _nearest_in_triangle(corners[t], x, y, z)
                out[i] |= (p - x) ** 2 + (q - y) ** 2 + (r - z) ** 2 < radius * radius
            if out[i]:
                break


@inner
def _meets(kind: int, pose: FloatArray, size: FloatArray, near: float, corners: FloatArray) -> bool:
    """Tell whether a core comes nearer than ``near`` to a triangle: by projections onto either in turn.

    Stops when two points that near are found, or a plane between both proves that there are none.
    """
    ax, ay, az = pose[0, 3], pose[1, 3], pose[2, 3]
    for _ in range(ITERATIONS):
        bx, by, bz = _nearest_in_triangle(corners, ax, ay, az)
        ax, ay, az = nearest_in_core(kind, pose, size, bx, by, bz)
        x, y, z = ax - bx, ay - by, az - bz
        distance = math.sqrt(x * x + y * y + z * z)
        if distance <= near or distance < TOUCHING_M:
            return True
        x, y, z = x / distance, y / distance, z / distance
        px, py, pz = lowest_in_core(kind, pose, size, x, y, z)
        highest = -math.inf
        for c in range(3):
            highest = max(highest, x * corners[c, 0] + y * corners[c, 1] + z * corners[c, 2])
        if px * x + py * y + pz * z - highest > near:
            return False
    return True


@compiled
def links_sink(
    chains: Chains,
    shapes: Shapes,
    triangles: Triangles,
    contact_of: IntArray,
    pose: FloatArray,
    joints: FloatArray,
    system: System,
    depth: float,
) -> bool:
    """Tell whether palm or links are deeper in a surface than tolerated; tips on contacts do not count.

    Args:
        chains: The fingers.
        shapes: The hand's shapes.
        triangles: The surface, in the world.
        contact_of: Contact of each finger or -1, shape (f,).
        pose: Pose of the palm frame in the world, shape (3, 4).
        joints: Joints by finger, shape (f, k).
        system: Work space.
        depth: Depth that is tolerated, m.
    """
    place_hand(chains, shapes, joints, system.frames, system.tips, system.poses)
    placed, size, work = np.empty((3, 4)), np.empty(3), np.empty((2, 3 + shapes.planes.shape[0], 3))
    corners, balls, planes, blocks, starts = triangles
    for s in range(system.poses.shape[0]):
        f, kind, radius = shapes.index[s, FINGER], shapes.index[s, KIND], shapes.size[s, RADIUS]
        if shapes.index[s, IS_TIP] == 1 and contact_of[f] >= 0:
            continue
        for row in range(3):
            # A shape without a rounded border is thinned by the tolerance, others by a smaller radius.
            size[row] = shapes.size[s, row] if radius > 0.0 else max(0.0, shapes.size[s, row] - depth)
            for column in range(4):
                value = pose[row, 3] if column == 3 else 0.0
                for i in range(3):
                    value += pose[row, i] * system.poses[s, i, column]
                placed[row, column] = value
        near, bound = max(0.0, radius - depth), shapes.size[s, BOUND]
        hulled = shapes.spans[s, PLANES + 1] > shapes.spans[s, PLANES]
        x, y, z = placed[0, 3], placed[1, 3], placed[2, 3]
        for b in range(blocks.shape[0]):
            far = bound + blocks[b, 3]
            if (blocks[b, 0] - x) ** 2 + (blocks[b, 1] - y) ** 2 + (blocks[b, 2] - z) ** 2 >= far * far:
                continue
            if not _near_ball(kind, placed, size, near, blocks[b]):
                continue
            for t in range(starts[b], starts[b + 1]):
                if not _near_ball(kind, placed, size, near, balls[t]):
                    continue
                if _beside(kind, placed, size, near, planes[t]):
                    continue
                if hulled and not cuts_hull(shapes, s, placed, depth, corners[t], work):
                    continue
                if hulled or _meets(kind, placed, size, near, corners[t]):
                    return True
    return False


@inner
def _near_ball(kind: int, pose: FloatArray, size: FloatArray, near: float, ball: FloatArray) -> bool:
    """Tell whether a core comes nearer than ``near`` to a ball."""
    x, y, z = nearest_in_core(kind, pose, size, ball[0], ball[1], ball[2])
    far = near + ball[3]
    is_near: bool = (x - ball[0]) ** 2 + (y - ball[1]) ** 2 + (z - ball[2]) ** 2 <= far * far
    return is_near


@inner
def _beside(kind: int, pose: FloatArray, size: FloatArray, near: float, plane: FloatArray) -> bool:
    """Tell whether all of a core is farther than ``near`` from a plane, on one side."""
    x, y, z, offset = plane[0], plane[1], plane[2], plane[3]
    if x * pose[0, 3] + y * pose[1, 3] + z * pose[2, 3] < offset:
        x, y, z, offset = -x, -y, -z, -offset
    px, py, pz = lowest_in_core(kind, pose, size, x, y, z)
    beside: bool = px * x + py * y + pz * z - offset > near
    return beside
