"""A trial's configuration: composed, validated, typed, and identified by its content."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import yaml

from graspbench.config import cost
from graspbench.config.bounds import MAX_SEED
from graspbench.config.compose import Composed, compose_configuration
from graspbench.config.exclusions import check_exploring, check_manipulation, check_motion
from graspbench.config.grid import expand_sweep, experiment_only, experiment_overrides
from graspbench.config.schema import (
    MANIPULATION_SECTIONS,
    NOT_SECTIONS,
    Primary,
    complete_with_defaults,
    follow,
    renewed,
    section_names,
    validate_section,
)
from graspbench.config.user_files import file_digests
from graspbench.config.values import Tree, set_values
from graspbench.errors import ConfigurationError, shown
from graspbench.geometry import ObjectParameters
from graspbench.grasp import QualityParameters
from graspbench.grasp.measure import MEASURES
from graspbench.hand import HandParameters
from graspbench.perception import CameraParameters, SilhouetteParameters, StationParameters
from graspbench.planning import AnyPlannerParameters, PlannerParameters, SearchParameters
from graspbench.planning.search.parameters import check_measure
from graspbench.reconstruction import SurfaceParameters
from graspbench.record import RecordParameters
from graspbench.simulation import SceneParameters
from graspbench.simulation.arm_parameters import ArmParameters
from graspbench.simulation.execution_parameters import ExecutionParameters
from graspbench.yaml_files import check_plain, read_yaml

if TYPE_CHECKING:
    from graspbench.manipulation import ClikParameters, ContactParameters, MotionParameters

# The dumper written in C, where there is one: the other takes as long as a small trial's planning.
_DUMPER = getattr(yaml, "CSafeDumper", yaml.SafeDumper)

# What a trial writes does not define what it is.
_NOT_IDENTITY = ("record",)


@dataclass(frozen=True)
class TrialConfig:
    """The parameters of every stage of one trial.

    Attributes:
        seed: Source of every random draw.
        index: Parameters of the index `index_name`.
        planner: Parameters of the planner `planner_name`.
        tree: The same as plain values.
        choice: The option chosen of each group, where that is known.
        overridden: Dotted keys that overrides or an experiment set, where that is known.
    """

    kind: ClassVar[Literal["trial", "manipulation"]] = "trial"

    seed: int
    object: ObjectParameters
    scene: SceneParameters
    camera: CameraParameters
    stations: StationParameters
    silhouette: SilhouetteParameters
    surface: SurfaceParameters
    hand: HandParameters
    arm: ArmParameters
    index_name: str
    index: Any
    planner_name: str
    planner: AnyPlannerParameters
    quality: QualityParameters
    search: SearchParameters
    execution: ExecutionParameters
    record: RecordParameters
    tree: Mapping[str, Any]
    choice: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    overridden: tuple[str, ...] = field(default=(), kw_only=True)

    @cached_property
    def trial_id(self) -> str:
        """Ten hexadecimal digits of a hash of what defines the trial, user files by their content."""
        identity = {key: value for key, value in self.tree.items() if key not in _NOT_IDENTITY}
        # How files are read and written defines no trial either.
        identity["hand"] = {key: value for key, value in self.tree["hand"].items() if key != "formats"}
        tasks = self.tree["clik"]["tasks"] if "clik" in self.tree else {}
        identity["files"] = file_digests(self.object, self.scene, self.hand, tasks, self.arm)
        text = json.dumps(identity, sort_keys=True, ensure_ascii=False)
        return hashlib.sha256(text.encode()).hexdigest()[:10]

    @property
    def warning(self) -> str | None:
        """What to say before the trial begins, when it is going to take long."""
        return cost.warning(vars(self))

    @property
    def local_planner(self) -> PlannerParameters:
        """Parameters of the local planner.

        Raises:
            ConfigurationError: Another planner is chosen.
        """
        if isinstance(self.planner, PlannerParameters):
            return self.planner
        raise ConfigurationError(
            f"the planner '{self.planner_name}' is not the local one, which this is about",
            remedy="leave planner= out, or take planner=parallel",
        )

    def as_tree(self) -> Tree:
        """Return the configuration as plain values."""
        return dict(self.tree)

    def as_yaml(self) -> str:
        """Return what ``config.yaml`` holds: the configuration, the choices and the overridden keys."""
        origin = {"choice": dict(self.choice), "overridden": list(self.overridden)}
        text: str = yaml.dump(self.as_tree() | origin, Dumper=_DUMPER, sort_keys=False, allow_unicode=True)
        return text


@dataclass(frozen=True)
class ManipulationConfig(TrialConfig):
    """The parameters of a trial whose hand then moves the object it grasps.

    Attributes:
        clik: Inverse kinematics of hand and object, with its secondary tasks.
        motion: What the object shall do.
        contact: How the fingertips meet the object.
    """

    kind: ClassVar[Literal["trial", "manipulation"]] = "manipulation"

    clik: "ClikParameters"
    motion: "MotionParameters"
    contact: "ContactParameters"


def load_config(overrides: Sequence[str] = (), config_dir: Path | None = None) -> TrialConfig:
    """Compose and validate the configuration of one trial.

    Args:
        overrides: Hydra overrides, for example ``["object=bottle", "hand.fingers=4"]``.
        config_dir: A user's folder with further groups and options.

    Raises:
        ConfigurationError: An option is unknown or a value cannot be used.
    """
    composed = compose_configuration(overrides, config_dir)
    return config_from_tree(_with_origin(composed))


def config_from_tree(tree: Mapping[str, Any]) -> TrialConfig:
    """Validate a configuration tree, for example one read from a trial's ``config.yaml``.

    Raises:
        ConfigurationError: An option is unknown or a value cannot be used.
    """
    complete, parts = _parts(tree, "config")
    return TrialConfig(tree=complete, **parts, **_origin(tree))


def load_manipulation_config(
    overrides: Sequence[str] = (), config_dir: Path | None = None
) -> ManipulationConfig:
    """Compose and validate the configuration of a manipulation.

    Args:
        overrides: Hydra overrides, for example ``["object=duck", "motion=rotate", "clik/tasks=none"]``.
        config_dir: A user's folder with further groups and options.

    Raises:
        ConfigurationError: An option is unknown or a value cannot be used.
    """
    composed = compose_configuration(overrides, config_dir, "manipulate")
    return manipulation_config_from_tree(_with_origin(composed))


def manipulation_config_from_tree(tree: Mapping[str, Any]) -> ManipulationConfig:
    """Validate a manipulation's configuration tree.

    Raises:
        ConfigurationError: An option is unknown or a value cannot be used.
    """
    complete, parts = _parts(tree, "manipulate")
    config = ManipulationConfig(tree=complete, **parts, **_origin(tree))
    check_manipulation(config)
    return config


def kind_of(overrides: Sequence[str], config_dir: Path | None = None) -> Primary:
    """Return the primary configuration that overrides ask for: one with a motion if they speak of it.

    Args:
        overrides: Hydra overrides of a trial or a sweep.
        config_dir: A user's folder, whose experiments may choose a motion.
    """
    named = [*overrides, *experiment_overrides(overrides, config_dir)]
    sections = {text.lstrip("+~").replace("/", ".").partition("=")[0].partition(".")[0] for text in named}
    return "manipulate" if sections & set(MANIPULATION_SECTIONS) else "config"


def load_any_config(
    overrides: Sequence[str] = (), config_dir: Path | None = None, primary: Primary = "config"
) -> TrialConfig:
    """Compose and validate the configuration of a trial of the kind that a primary configuration makes.

    Raises:
        ConfigurationError: An option is unknown or a value cannot be used.
    """
    load = load_manipulation_config if primary == "manipulate" else load_config
    return load(overrides, config_dir)


def load_one_config(
    overrides: Sequence[str] = (), config_dir: Path | None = None, primary: Primary | None = None
) -> TrialConfig:
    """Compose and validate the one trial that overrides make, of the kind that they ask for.

    Args:
        overrides: Hydra overrides; an experiment among them must be of one trial.
        config_dir: A user's folder with further groups and options.
        primary: The kind; None for what the overrides speak of.

    Raises:
        ConfigurationError: An option is unknown, a value cannot be used, or the experiment is a grid.
    """
    wanted = primary or kind_of(overrides, config_dir)
    if len(grid := expand_sweep(experiment_only(overrides), config_dir, wanted)) > 1:
        raise ConfigurationError(
            f"the experiment is a grid of {len(grid)} trials", remedy="run it with 'graspbench sweep'"
        )
    return load_any_config(overrides, config_dir, wanted)


def load_stored_config(path: Path, overrides: Sequence[str] = ()) -> TrialConfig:
    """Read the configuration of a stored trial, to run it again.

    Args:
        path: A trial's ``config.yaml``, or the trial's folder.
        overrides: Values that shall differ.

    Raises:
        ConfigurationError: There is no such file, it is no configuration, or a value cannot be used.
    """
    file = path / "config.yaml" if path.is_dir() else path
    tree = read_yaml(file)
    if not isinstance(tree, dict):
        raise ConfigurationError(f"{file} holds no configuration", remedy="give a trial's config.yaml")
    check_plain(tree, "the configuration")
    in_hand = any(section in tree for section in MANIPULATION_SECTIONS)
    origin = {key: tree[key] for key in ("choice", "overridden") if key in tree}
    values = renewed({str(key): value for key, value in tree.items() if key not in NOT_SECTIONS})
    if overrides:
        changed = set_values(complete_with_defaults(values, "manipulate" if in_hand else "config"), overrides)
        values = {**changed}
        more = [text.partition("=")[0].lstrip("+") for text in overrides]
        origin["overridden"] = list(dict.fromkeys([*(origin.get("overridden") or []), *more]))
    return (manipulation_config_from_tree if in_hand else config_from_tree)(values | origin)


def _with_origin(composed: Composed) -> Tree:
    return composed.tree | {"choice": dict(composed.choice), "overridden": list(composed.overridden)}


def _origin(tree: Mapping[str, Any]) -> dict[str, Any]:
    """Return where a tree's values come from, as far as it says so."""
    choice, overridden = tree.get("choice"), tree.get("overridden")
    return {
        "choice": {str(k): str(v) for k, v in choice.items()} if isinstance(choice, Mapping) else {},
        "overridden": tuple(str(k) for k in overridden) if isinstance(overridden, list) else (),
    }


def _parts(tree: Mapping[str, Any], primary: Primary) -> tuple[Tree, dict[str, Any]]:
    """Return the complete tree, and the parameters made from it by name."""
    check_plain(tree, "the configuration")
    seed = tree.get("seed", 0)
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed <= MAX_SEED:
        raise ConfigurationError(
            f"seed = {shown(seed)} cannot be used", remedy=f"give a whole number from 0 to {MAX_SEED}"
        )
    complete = follow(complete_with_defaults(tree, primary))
    parts = {section: validate_section(section, complete[section]) for section in section_names(primary)}
    cost.check_cost(parts)
    check_motion(parts["scene"], primary)
    check_exploring(parts["scene"], parts["arm"], parts["execution"].touch)
    for name in parts["quality"].measures:
        MEASURES[name]  # refused before anything runs
    if parts["search"].enabled:
        for name in parts["search"].measures:
            check_measure(name, parts["hand"].fingers)
    return complete, {
        "seed": seed,
        "index_name": complete["index"]["name"],
        "planner_name": complete["planner"]["name"],
        **parts,
    }
