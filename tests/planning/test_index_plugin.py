"""An index from another distribution: found by its entry point, without a change here."""

import importlib
import sys
import textwrap

import numpy as np
import pytest

from graspbench.errors import ConfigurationError
from graspbench.grasp.quality import QualityParameters
from graspbench.planning import index as index_module
from graspbench.planning.local import plan_local
from graspbench.planning.parameters import PlannerParameters
from graspbench.registry import Registry
from tests.planning.shapes import radial, shrinking

MODULE = '''
from dataclasses import dataclass
from typing import ClassVar

import numpy as np


@dataclass(frozen=True)
class NarrowWaistParameters:
    direction: float = -1.0
    pull: float = 0.0


class NarrowWaist:
    """Goes where the contacts are closest together."""

    parameters: ClassVar[type] = NarrowWaistParameters
    centre_option: ClassVar[str] = "pull"

    def __init__(self, parameters, n_f, quality=None):
        self._sign = parameters.direction

    def propose(self, surface, vertices, moves):
        best, here = None, self.score(surface, vertices)
        for i in range(len(vertices)):
            for node in moves.nodes[i, 1:]:
                other = vertices.copy()
                other[i] = node
                if node >= 0 and len(set(other)) == len(other) and self.score(surface, other) > here + 1e-12:
                    best, here = other, self.score(surface, other)
        return best

    def score(self, surface, vertices):
        arms = surface.points[vertices] - surface.centroid
        return float(self._sign * np.linalg.norm(arms, axis=1).sum())
'''


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    """Install a distribution by hand: a module, and the metadata that pip would write."""
    (tmp_path / "narrow_waist_plugin.py").write_text(MODULE)
    metadata = tmp_path / "narrow_waist-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: narrow-waist\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(
        textwrap.dedent("""\
            [graspbench.index]
            narrow_waist = narrow_waist_plugin:NarrowWaist
        """)
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    importlib.invalidate_caches()
    fresh = Registry("index", "graspbench.planning.indices")
    for name in ("force_field", "mirtich_canny", "quality_ascent"):
        fresh.register(name)(index_module.INDICES[name])
    monkeypatch.setattr(index_module, "INDICES", fresh)
    yield fresh
    sys.modules.pop("narrow_waist_plugin", None)


def test_is_found_beside_the_built_in_ones(plugin):
    assert plugin.names() == ("force_field", "mirtich_canny", "narrow_waist", "quality_ascent")


def test_plans_with_its_own_parameters(plugin):
    shrunk, moves = {}, {}
    for direction in (-1.0, 0.0):
        parameters = plugin["narrow_waist"].parameters(direction=direction)
        index = index_module.make_index("narrow_waist", parameters, 3)
        surfaces = shrinking(radial(lambda d: 0.04 - 0.005 * d[:, 0] ** 2), steps=3)
        planner = PlannerParameters(rotations=2, planes=2, select="first")
        plan = plan_local(iter(surfaces), index, None, 3, planner, QualityParameters(friction=1.5))
        shrunk[direction] = np.linalg.norm(plan.grasp.points - plan.grasp.centroid, axis=1).mean()
        moves[direction] = plan.moves
    assert moves[0.0] == 0 < moves[-1.0]
    assert shrunk[-1.0] < shrunk[0.0]


def test_unknown_index_names_the_known_ones(plugin):
    with pytest.raises(ConfigurationError, match="unknown index 'nothing': choose one of force_field"):
        index_module.make_index("nothing", None, 3)


def test_built_in_indices_have_parameters_with_defaults():
    for name in ("force_field", "mirtich_canny", "quality_ascent"):
        made = index_module.make_index(name, index_module.INDICES[name].parameters(), 3)
        assert callable(made.propose)
        assert callable(made.score)


def test_an_index_of_another_distribution_may_pull_to_the_centroid_by_its_own_option(plugin):
    parameters = plugin["narrow_waist"].parameters(pull=0.5)
    assert index_module.centre_option("narrow_waist") == "pull"
    assert index_module.centre_gain("narrow_waist", parameters) == 0.5
    assert index_module.centre_option("force_field") == "k_cm"
    for name in ("mirtich_canny", "quality_ascent"):
        assert index_module.centre_gain(name, plugin[name].parameters()) is None


def test_only_an_index_that_climbs_by_itself_is_a_climbing_index(plugin):
    climbing = {
        name
        for name in plugin.names()
        if isinstance(index_module.make_index(name, plugin[name].parameters(), 3), index_module.ClimbingIndex)
    }
    assert climbing == {"force_field"}
