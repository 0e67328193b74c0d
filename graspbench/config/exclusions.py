"""What excludes each other in a configuration: refused before anything runs, in a sentence."""

from typing import TYPE_CHECKING

from graspbench.config.schema import Primary
from graspbench.errors import ConfigurationError
from graspbench.simulation import SceneParameters
from graspbench.simulation.arm_parameters import ArmParameters
from graspbench.simulation.touch_parameters import TouchParameters

if TYPE_CHECKING:
    from graspbench.config.trial_config import ManipulationConfig


def check_exploring(scene: SceneParameters, arm: ArmParameters, touch: TouchParameters) -> None:
    """Refuse exploring grasps together with what moves the goal under them, or with an arm."""
    for key, used in (
        ("execution.touch.max_touches", touch.max_touches > 0),
        ("scene.motion", scene.motion != "none"),
        ("an arm", arm.urdf is not None),
    ):
        if touch.max_grasps and used:
            raise ConfigurationError(
                f"execution.touch.max_grasps = {touch.max_grasps} and {key} exclude each other",
                remedy=f"leave one of execution.touch.max_grasps and {key} out",
                key=key,
            )


def check_motion(scene: SceneParameters, primary: Primary) -> None:
    """Refuse a moving or a shifted object where nothing can be moved."""
    if (scene.unseen_shift_mm or scene.unseen_turn_deg) and scene.source != "simulation":
        raise ConfigurationError(
            "an object on images from files cannot be shifted after it was seen",
            remedy="leave scene.unseen_shift_mm and scene.unseen_turn_deg at 0",
            key="scene.unseen_shift_mm",
            value=scene.unseen_shift_mm,
        )
    if (scene.unseen_shift_mm or scene.unseen_turn_deg) and scene.motion != "none":
        raise ConfigurationError(
            f"scene.motion = {scene.motion} and an unseen shift of the object exclude each other",
            remedy="leave one of scene.motion and scene.unseen_shift_mm, scene.unseen_turn_deg out",
            key="scene.motion",
            value=scene.motion,
        )
    if scene.motion == "none" or (scene.source == "simulation" and primary == "config"):
        return
    what = "images from files" if scene.source != "simulation" else "in-hand motions"
    raise ConfigurationError(
        f"scene.motion = {scene.motion} cannot be used with {what}",
        remedy="leave scene.motion out, or run a grasp with the simulated camera (scene.source=simulation)",
        key="scene.motion",
        value=scene.motion,
    )


def _check_gait(config: "ManipulationConfig") -> None:
    """Refuse a gait of fingers or on contacts that can never do it."""
    from graspbench.manipulation.gaiting.gait_parameters import GAITING

    if config.motion.gait.angle_deg == 0.0:
        return
    if config.contact.kind not in GAITING:
        raise ConfigurationError(
            f"fingers do not gait on contacts of kind '{config.contact.kind}'",
            remedy=f"set contact to one of {', '.join(GAITING)}",
        )
    if config.hand.fingers < 3:
        raise ConfigurationError(
            "two fingers cannot gait: one alone does not hold the object", remedy="set hand.fingers=4"
        )
    if config.execution.until != "off" and config.execution.control != "joint_impedance":
        raise ConfigurationError(
            f"fingers that step are not driven by execution.control = {config.execution.control}",
            remedy="set execution.control=joint_impedance",
            key="execution.control",
            value=config.execution.control,
        )


def _check_sliding(config: "ManipulationConfig") -> None:
    """Refuse contacts that can never slide on purpose."""
    named, fingers = config.contact.sliding.fingers, config.hand.fingers
    if not named:
        return
    wrong, remedy = None, f"count from 0 to {fingers - 1}"
    if any(not 0 <= finger < fingers for finger in named):
        wrong = f"names a finger that {fingers} fingers do not have"
    elif len(set(named)) < len(named):
        wrong, remedy = "names a finger twice", "name each once"
    elif len(named) == fingers:
        wrong, remedy = "lets all fingers slide, so that none holds the object", "leave one out"
    elif config.contact.kind in ("frictionless", "soft_pad"):
        wrong = f"fits no contacts of kind '{config.contact.kind}'"
        remedy = "set contact to one of rolling, hard, soft"
    elif config.execution.until != "off" and config.execution.control != "joint_impedance":
        wrong = f"does not go with execution.control = {config.execution.control}"
        remedy = "set execution.control=joint_impedance"
    elif config.motion.gait.angle_deg != 0.0:
        wrong, remedy = "does not go with finger gaiting", "leave motion.gait.angle_deg out"
    if wrong is not None:
        raise ConfigurationError(
            f"contact.sliding.fingers = {list(named)} {wrong}",
            remedy=remedy,
            key="contact.sliding.fingers",
            value=list(named),
        )


def check_manipulation(config: "ManipulationConfig") -> None:
    """Refuse what fits neither the hand's fingers nor the control period."""
    if config.hand.tip_shape == "link":
        raise ConfigurationError(
            "objects are moved in the hand by spherical fingertips, which roll on them: not with "
            "hand.tip_shape=link",
            remedy="set hand.tip_shape=sphere",
        )
    fingers = config.hand.fingers
    for name, options in config.clik.tasks.items():
        for key in ("fingers", "first", "second", "contacts", "middle_of"):
            value = options.get(key)
            named = value if isinstance(value, list | tuple) else [] if value is None else [value]
            if any(not 0 <= int(finger) < fingers for finger in named):
                raise ConfigurationError(
                    f"clik.tasks.{name}.{key} = {value} names a finger that {fingers} fingers do not have",
                    remedy=f"count from 0 to {fingers - 1}",
                )
    _check_gait(config)
    _check_sliding(config)
    if config.clik.step_s > 0.1 * config.motion.duration_s:
        raise ConfigurationError(
            f"clik.step_s = {config.clik.step_s:g} is too long for {config.motion.duration_s:g} s of motion",
            remedy="take a tenth of motion.duration_s or less",
        )
