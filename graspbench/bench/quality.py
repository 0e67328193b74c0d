"""Quality measures and force closure of a batch of grasps, against scipy and NumPy in the same run."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from graspbench.arrays import FloatArray
from graspbench.bench.result import BenchResult
from graspbench.bench.timing import best_time
from graspbench.grasp.contact import ContactModel, ContactPolytope, contact_polytope
from graspbench.grasp.epsilon import CLOSURE_TOLERANCE, smallest_support
from graspbench.grasp.quality import singular_measures
from graspbench.grasp.wrench import WrenchSpace, grasp_matrix, wrench_maps

CASES: tuple[tuple[ContactModel, WrenchSpace, int], ...] = (
    ("hard_finger", "spatial", 3),
    ("hard_finger", "spatial", 4),
    ("soft_finger", "spatial", 2),
    ("hard_finger", "planar", 3),
    ("frictionless", "planar", 4),
    ("frictionless", "spatial", 7),
)
"""Contact model, wrench space and number of contacts of each batch."""

SHOWN = ("contact", "wrench_space", "contacts", "measure", "us", "peer_us", "ratio", "largest_difference")


def run(output_dir: Path | None = None, *, grasps: int = 1000, quick: bool = False) -> BenchResult:
    """Measure exact Q3, Q1 and Q2, and force closure, for every case of `CASES`.

    Q3 is measured on grasps that are all force closure, of the others it is much sooner known; the rest on a
    batch where every second one is.

    Args:
        output_dir: Not used; there is no plot.
        grasps: Grasps of a batch. Qhull and the linear programs get a tenth of them, the same mixture.
        quick: Measure 20 grasps, once.
    """
    rows: list[dict[str, object]] = []
    count, repeats = (20, 1) if quick else (grasps, 3)
    for contact, space, n_f in CASES:
        polytope = contact_polytope(contact)
        maps = _grasps(contact, space, n_f, polytope, 2 * count)
        wrenches = polytope.vertices @ np.swapaxes(maps, -1, -2)
        held, wrenches, maps = wrenches[::2], wrenches[:count], maps[:count]
        few = wrenches[: max(count // 10, 10)]
        case = {
            "contact": contact,
            "wrench_space": space,
            "contacts": n_f,
            "corners": few.shape[1] * few.shape[2],
        }
        closure = partial(_closed, wrenches, polytope)
        matrices = grasp_matrix(maps)
        pairs: tuple[tuple[str, str, Callable[[], FloatArray], Callable[[], FloatArray], int], ...] = (
            (
                "q3",
                "scipy ConvexHull",
                partial(_ball, held, polytope),
                partial(_qhull, held[: len(few)]),
                len(few),
            ),
            (
                "q1 and q2",
                "numpy SVD, one by one",
                partial(_singular, matrices),
                partial(_svd, matrices),
                count,
            ),
            ("force closure", "scipy linprog (HiGHS)", closure, partial(_linear_programs, few), len(few)),
        )
        for what, peer, ours, theirs, peer_count in pairs:
            ours()  # compiled, when it is
            time_s, values = best_time(ours, repeats)
            peer_s, peer_values = best_time(theirs, 1 if peer_count < count else repeats)
            each, peer_each = 1e6 * time_s / count, 1e6 * peer_s / peer_count
            rows.append(
                {
                    **case,
                    "measure": what,
                    "peer": peer,
                    "grasps": count,
                    "peer_grasps": peer_count,
                    "us": each,
                    "peer_us": peer_each,
                    "ratio": peer_each / each,
                    "largest_difference": float(np.abs(values[:peer_count] - peer_values).max()),
                }
            )
    return BenchResult("quality", tuple(rows), shown=SHOWN)


def _grasps(
    contact: ContactModel, space: WrenchSpace, n_f: int, polytope: ContactPolytope, count: int
) -> FloatArray:
    """Return the wrench maps of random grasps of a ball-like object, every second one force closure."""
    rng = np.random.default_rng(0)
    found: list[list[FloatArray]] = [[], []]
    wanted = count - count // 2
    while min(len(kind) for kind in found) < wanted:
        points = rng.standard_normal((500, n_f, 3))
        points /= np.linalg.norm(points, axis=-1, keepdims=True)
        normals = -points + 0.3 * rng.standard_normal(points.shape)
        if space == "planar":
            points[..., 2] = normals[..., 2] = 0.0
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
        maps = wrench_maps(points, normals, np.zeros(3), contact=contact, wrench_space=space)
        closed = _closed(polytope.vertices @ np.swapaxes(maps, -1, -2), polytope) > 0.0
        for kind, chosen in zip(found, (maps[closed], maps[~closed]), strict=True):
            kind.extend(chosen[: wanted - len(kind)])
    mixed = np.stack([grasp for pair in zip(*found, strict=True) for grasp in pair])
    return np.asarray(mixed[:count])


def _ball(wrenches: FloatArray, polytope: ContactPolytope) -> FloatArray:
    return np.maximum(smallest_support(wrenches, polytope, stop_at=CLOSURE_TOLERANCE), 0.0)


def _closed(wrenches: FloatArray, polytope: ContactPolytope) -> FloatArray:
    return np.asarray(_ball(wrenches, polytope) > CLOSURE_TOLERANCE, dtype=np.float64)


def _singular(matrices: FloatArray) -> FloatArray:
    return np.stack(singular_measures(matrices), axis=-1)


def _svd(matrices: FloatArray) -> FloatArray:
    found = []
    for matrix in matrices:
        values = np.linalg.svd(matrix, compute_uv=False)
        found.append((values[-1], np.prod(values)))
    return np.array(found)


def _qhull(wrenches: FloatArray) -> FloatArray:
    size = wrenches.shape[-1]
    offsets = [ConvexHull(grasp.reshape(-1, size)).equations[:, -1].max() for grasp in wrenches]
    return np.maximum(-np.array(offsets, dtype=np.float64), 0.0)


def _linear_programs(wrenches: FloatArray) -> FloatArray:
    """Tell whether weights of at least one balance the corner wrenches."""
    size = wrenches.shape[-1]
    balanced = [
        linprog(
            np.zeros(grasp.size // size),
            A_eq=grasp.reshape(-1, size).T,
            b_eq=np.zeros(size),
            bounds=(1.0, None),
        ).status
        == 0
        for grasp in wrenches
    ]
    return np.array(balanced, dtype=np.float64)
