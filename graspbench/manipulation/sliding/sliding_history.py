"""How fingertips slide over the object along a motion."""

from dataclasses import dataclass

from graspbench.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class SlidingHistory:
    """A row whenever forces were computed, palm frame.

    Attributes:
        fingers: Finger of the hand at each contact.
        contacts: Contacts that slide on purpose.
        slips: Velocities of the tips over the object, of what touches, shape (s, n_c, 3), m/s.
        spins: Of the tips against the object about the outward normals, shape (s, n_c), rad/s.
        margins: Friction left at each contact, as in `ContactForces`, shape (s, n_c), N; 0 where it slides.
    """

    fingers: tuple[int, ...]
    contacts: tuple[int, ...]
    slips: FloatArray
    spins: FloatArray
    margins: FloatArray
