"""What the study tries: hands, objects, friction and mass, each drawn from the case's own number."""

from dataclasses import dataclass

import numpy as np

from graspbench.geometry import list_objects

HANDS: dict[str, tuple[str, ...]] = {
    "radial": ("hand=radial",),
    "allegro": ("hand=allegro",),
    "radial_4": ("hand=radial", "hand.fingers=4", "hand.link_lengths_m=[0.060,0.045,0.035]"),
}
"""Three hands: evenly spaced fingers, an anthropomorphic hand, and four shorter fingers."""

FRICTIONS = (0.35, 0.5, 0.8)
MASSES_KG = (0.05, 0.15, 0.45)

SETTINGS = (
    "index.k_cm=1",
    "search.enabled=false",
    "record=off",
    "scene.yaw_deg=null",
    "execution=pushes",
    "execution.grip_force_n=0.5",
)
"""How trials are set; grip forces in proportion to the weight make forces in weights comparable."""

MAX_RANDOM = 1000


@dataclass(frozen=True)
class Case:
    """One object as the study sees it, with each hand.

    Attributes:
        number: Its place in the order; source of every draw.
        object: Name of the object.
        overrides: What chooses it.
        friction: Coulomb friction of the fingertips, planned and real.
        mass_kg: Mass of the object.
    """

    number: int
    object: str
    overrides: tuple[str, ...]
    friction: float
    mass_kg: float

    def rng(self, hand: str) -> np.random.Generator:
        """Return a generator of random numbers for the grasps of one hand."""
        return np.random.default_rng([self.number, list(HANDS).index(hand)])


def case(number: int) -> Case:
    """Return a case by its number: a catalogue object and a random one in turn, then random ones."""
    catalogue = [name for name in list_objects() if name not in ("random", "bowling_pin")]
    half, odd = divmod(number, 2)
    if not odd and half < len(catalogue):
        return _case(number, catalogue[half], (f"object={catalogue[half]}",))
    known = min(len(catalogue), (number + 1) // 2)
    row = (number - known) % MAX_RANDOM
    return _case(number, f"random_{row:03d}", ("object=random", f"object.id={row}"))


def _case(number: int, name: str, chosen: tuple[str, ...]) -> Case:
    rng = np.random.default_rng([number, 99])
    friction, mass_kg = float(rng.choice(FRICTIONS)), float(rng.choice(MASSES_KG))
    return Case(number, name, chosen, friction, mass_kg)
