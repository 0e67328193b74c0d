"""Measures of grasps: registered functions, each with its definition, range, unit and source.

A measure is a function of a batch of grasps, registered in a module of `graspbench.grasp.measures` or by
another distribution, whose entry point of the group ``graspbench.measure`` names the decorated function.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from graspbench.arrays import FloatArray
from graspbench.errors import ConfigurationError
from graspbench.grasp.contact import ContactPolytope
from graspbench.grasp.quality import QualityParameters, unit_batch
from graspbench.grasp.wrench import wrench_maps
from graspbench.registry import Registry


@dataclass(frozen=True, eq=False)
class GraspBatch:
    """What a measure may look at.

    Attributes:
        points: Contact points, shape (n, n_f, 3), m.
        normals_in: Unit normals pointing into the object, shape (n, n_f, 3).
        centre: Centre of the moments, shape (3,), m.
        maps: Each contact's map from its force basis to the wrench space, shape (n, n_f, d, n_basis).
        quality: Contact model and its parameters.
        torque_length_m: What moments are divided by, m.
    """

    points: FloatArray
    normals_in: FloatArray
    centre: FloatArray
    maps: FloatArray
    quality: QualityParameters
    torque_length_m: float

    @property
    def polytope(self) -> ContactPolytope:
        """The linearised unit friction cone."""
        return self.quality.polytope(self.torque_length_m)

    @property
    def wrenches(self) -> FloatArray:
        """Wrenches of the cone's corners, shape (n, n_f, n_vertices, d)."""
        return np.asarray(self.polytope.vertices @ np.swapaxes(self.maps, -1, -2))


MeasureFunction: TypeAlias = Callable[[GraspBatch], FloatArray]


@dataclass(frozen=True)
class Measure:
    """A registered measure.

    Attributes:
        name: As in the configuration.
        evaluate: Returns one value a grasp, shape (n,).
        definition: What it is, in one sentence.
        value_range: Values it can take.
        unit: Its unit; "1" for none.
        better: "larger" or "smaller".
        source: Where it is from.
    """

    name: str
    evaluate: MeasureFunction
    definition: str
    value_range: str
    unit: str
    better: str
    source: str


MEASURES: Registry[Measure] = Registry("measure", "graspbench.grasp.measures")


def measure(
    name: str, *, definition: str, value_range: str, unit: str, source: str, better: str = "larger"
) -> Callable[[MeasureFunction], Measure]:
    """Return a decorator that makes a function a registered measure; see `Measure` for the arguments."""

    def decorate(function: MeasureFunction) -> Measure:
        made = Measure(name, function, definition, value_range, unit, better, source)
        MEASURES.register(name)(made)
        return made

    return decorate


def evaluate_measures(
    names: Sequence[str],
    points: FloatArray,
    normals_in: FloatArray,
    centre: FloatArray,
    quality: QualityParameters,
    torque_length_m: float,
) -> dict[str, FloatArray]:
    """Evaluate registered measures of one grasp or a batch.

    Args:
        names: Of the measures.
        points: Contact points, shape (n_f, 3) or (n, n_f, 3), m.
        normals_in: Normals pointing into the object, same shape.
        centre: Centre of the moments, shape (3,), m.
        quality: Contact model and its parameters.
        torque_length_m: Moments are divided by it, m.

    Returns:
        An array of shape () or (n,) by name.

    Raises:
        ConfigurationError: A measure is unknown, or gives values of the wrong shape.
    """
    points, normals_in = unit_batch(points, normals_in)
    shape = points.shape[:-2]
    stacked = points.reshape(-1, *points.shape[-2:]), normals_in.reshape(-1, *points.shape[-2:])
    centre = np.asarray(centre, dtype=np.float64)
    maps = wrench_maps(
        *stacked,
        centre,
        contact=quality.contact,
        wrench_space=quality.wrench_space,
        torque_length=torque_length_m,
    )
    batch = GraspBatch(*stacked, centre, maps, quality, torque_length_m)
    values = {}
    for name in names:
        found = np.asarray(MEASURES[name].evaluate(batch), dtype=np.float64)
        if found.shape != (len(stacked[0]),):
            raise ConfigurationError(
                f"measure '{name}' gave values of shape {found.shape} for {len(stacked[0])} grasps",
                remedy="return one value a grasp",
            )
        values[name] = found.reshape(shape)
    return values


def describe_measures() -> list[dict[str, str]]:
    """Return what each registered measure is, in rows."""
    rows = []
    for name in MEASURES:
        one = MEASURES[name]
        rows.append(
            {
                "name": name,
                "definition": one.definition,
                "range": one.value_range,
                "unit": one.unit,
                "better": one.better,
                "source": one.source,
            }
        )
    return rows
