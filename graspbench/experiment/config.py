"""A trial's configuration: composed, validated, typed, and identified by its content."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from graspbench.errors import ConfigurationError
from graspbench.experiment.compose import Tree, compose_tree
from graspbench.experiment.schema import Primary, complete_with_defaults, section_names, validate_section
from graspbench.geometry import ObjectParameters
from graspbench.grasp import QualityParameters
from graspbench.grasp.measure import MEASURES
from graspbench.hand import HandParameters
from graspbench.perception import CameraParameters, SilhouetteParameters, StationParameters
from graspbench.planning import PlannerParameters, SearchParameters
from graspbench.reconstruction import SurfaceParameters
from graspbench.record import RecordParameters
from graspbench.simulation import SceneParameters
from graspbench.simulation.execution_parameters import ExecutionParameters

if TYPE_CHECKING:
    from graspbench.manipulation import ClikParameters, ContactParameters, MotionParameters

# What a trial writes does not define what it is.
_NOT_IDENTITY = ("record",)


@dataclass(frozen=True)
class TrialConfig:
    """The parameters of every stage of one trial.

    Attributes:
        seed: Source of every random draw.
        index: Parameters of the index `index_name`.
        tree: The same as plain values; what ``config.yaml`` holds.
    """

    seed: int
    object: ObjectParameters
    scene: SceneParameters
    camera: CameraParameters
    stations: StationParameters
    silhouette: SilhouetteParameters
    surface: SurfaceParameters
    hand: HandParameters
    index_name: str
    index: Any
    planner: PlannerParameters
    quality: QualityParameters
    search: SearchParameters
    execution: ExecutionParameters
    record: RecordParameters
    tree: Mapping[str, Any]

    @property
    def trial_id(self) -> str:
        """Ten hexadecimal digits of a hash of what defines the trial, user files by their content."""
        identity = {key: value for key, value in self.tree.items() if key not in _NOT_IDENTITY}
        identity["files"] = _file_digests(identity)
        text = json.dumps(identity, sort_keys=True, ensure_ascii=False)
        return hashlib.sha256(text.encode()).hexdigest()[:10]

    def as_tree(self) -> Tree:
        """Return the configuration as plain values."""
        return dict(self.tree)


@dataclass(frozen=True)
class ManipulationConfig(TrialConfig):
    """The parameters of a trial whose hand then moves the object it grasps.

    Attributes:
        clik: Inverse kinematics of hand and object, with its secondary tasks.
        motion: What the object shall do.
        contact: How the fingertips meet the object.
    """

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
    return config_from_tree(compose_tree(overrides, config_dir))


def config_from_tree(tree: Mapping[str, Any]) -> TrialConfig:
    """Validate a configuration tree, for example one read from a trial's ``config.yaml``.

    Raises:
        ConfigurationError: An option is unknown or a value cannot be used.
    """
    complete, parts = _parts(tree, "config")
    return TrialConfig(tree=complete, **parts)


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
    return manipulation_config_from_tree(compose_tree(overrides, config_dir, "manipulate"))


def manipulation_config_from_tree(tree: Mapping[str, Any]) -> ManipulationConfig:
    """Validate a manipulation's configuration tree.

    Raises:
        ConfigurationError: An option is unknown or a value cannot be used.
    """
    complete, parts = _parts(tree, "manipulate")
    config = ManipulationConfig(tree=complete, **parts)
    _check_manipulation(config)
    return config


def _parts(tree: Mapping[str, Any], primary: Primary) -> tuple[Tree, dict[str, Any]]:
    """Return the complete tree, and the parameters made from it by name."""
    seed = tree.get("seed", 0)
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise ConfigurationError(f"seed = {seed!r} cannot be used", remedy="give a whole number from 0 on")
    complete = complete_with_defaults(tree, primary)
    parts = {section: validate_section(section, complete[section]) for section in section_names(primary)}
    for name in parts["quality"].measures:
        MEASURES[name]  # refused before anything runs
    return complete, {"seed": seed, "index_name": complete["index"]["name"], **parts}


def _check_manipulation(config: ManipulationConfig) -> None:
    """Refuse what fits neither the hand's fingers nor the control period."""
    fingers = config.hand.fingers
    for name, options in config.clik.tasks.items():
        for key in ("finger", "first", "second", "contacts", "middle_of"):
            value = options.get(key)
            named = value if isinstance(value, list | tuple) else [] if value is None else [value]
            if any(not 0 <= int(finger) < fingers for finger in named):
                raise ConfigurationError(
                    f"clik.tasks.{name}.{key} = {value} names a finger that {fingers} fingers do not have",
                    remedy=f"count from 0 to {fingers - 1}",
                )
    if config.clik.step_s > 0.1 * config.motion.duration_s:
        raise ConfigurationError(
            f"clik.step_s = {config.clik.step_s:g} is too long for {config.motion.duration_s:g} s of motion",
            remedy="take a tenth of motion.duration_s or less",
        )


def _file_digests(tree: Mapping[str, Any]) -> dict[str, str]:
    """Digest the files a configuration points to, so that a changed mesh is another trial."""
    digests = {}
    for key in ("mesh", "folder"):
        value = tree["object"].get(key)
        if value and Path(value).is_file():
            digests[f"object.{key}"] = hashlib.sha256(Path(value).read_bytes()).hexdigest()
    return digests
