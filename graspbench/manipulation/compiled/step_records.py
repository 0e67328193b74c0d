"""What the compiled inverse kinematics reads and writes, each array declared once (see `record`).

Sizes: ``joints`` n_q, ``contacts`` n_c, ``variables`` n, ``twist_rows`` (those of a twist that count: 6, or 3
in the plane), ``stacked_rows`` m = twist_rows contacts, ``free`` n - m.
"""

from typing import Annotated

from graspbench.arrays import FloatArray, IntArray
from graspbench.manipulation.compiled.record import Record


class SystemArrays(Record):
    """What does not change while the object moves; see `contact_kinematics.ManipulationSystem`.

    Contacts whose fingers share joints form a group; variables that move no contact form one more. Jt has no
    entries between groups.

    Attributes:
        joint_turns: A joint's rotation in its parent is [0] + cos q [1] + sin q [2].
        placement_translations: Of the joints in their parents, m.
        axes: Of the joints, in their own frames.
        tip_rotations: Of the finger frames in the frames of their joints.
        tip_translations: Of the finger frames there, m.
        tip_radii: Of the spherical tips, m.
        chart_rotations: Of the contacts' charts in the object frame.
        chart_origins: Their origins there, m.
        chart_numbers: Numbers of their formulas.
        parents: Joint each joint is mounted on, or -1.
        tip_joints: Joint of each finger frame.
        paths: 1 where a joint moves a tip.
        chart_kinds: `chart_formulas.ChartKind` of each contact.
        rolling: 1 for rolling contacts.
        xi_columns: Variable of each contact coordinate, -1 where it is constant.
        theta_columns: Variable of each ball joint angle, -1 where it is constant.
        twist_components: Rows of a twist that count: all six, or x, y, omega_z.
        group_rows: Rows of Jt, group by group.
        group_row_starts: Where each group's rows begin, and the end.
        group_columns: Columns of Jt, group by group.
        group_column_starts: Where each group's columns begin, and the end.
    """

    joint_turns: Annotated[FloatArray, "joints", 3, 3, 3]
    placement_translations: Annotated[FloatArray, "joints", 3]
    axes: Annotated[FloatArray, "joints", 3]
    tip_rotations: Annotated[FloatArray, "contacts", 3, 3]
    tip_translations: Annotated[FloatArray, "contacts", 3]
    tip_radii: Annotated[FloatArray, "contacts"]
    chart_rotations: Annotated[FloatArray, "contacts", 3, 3]
    chart_origins: Annotated[FloatArray, "contacts", 3]
    chart_numbers: Annotated[FloatArray, "contacts", "chart_numbers"]
    parents: Annotated[IntArray, "joints"]
    tip_joints: Annotated[IntArray, "contacts"]
    paths: Annotated[IntArray, "contacts", "joints"]
    chart_kinds: Annotated[IntArray, "contacts"]
    rolling: Annotated[IntArray, "contacts"]
    xi_columns: Annotated[IntArray, "contacts", 2]
    theta_columns: Annotated[IntArray, "contacts", 3]
    twist_components: Annotated[IntArray, "twist_rows"]
    group_rows: Annotated[IntArray, "stacked_rows"]
    group_row_starts: Annotated[IntArray, "group_starts"]
    group_columns: Annotated[IntArray, "variables"]
    group_column_starts: Annotated[IntArray, "group_starts"]


class StateArrays(Record):
    """A configuration and what follows from it; base frame unless said otherwise.

    Attributes:
        joints: q, rad.
        contact_variables: [xi; theta] of each contact.
        joint_rotations: Orientation of the joints' frames.
        joint_origins: Their origins, m.
        joint_axes: Their axes.
        tip_positions: Centres of the tips, m.
        tip_rotations: Orientation of the finger frames.
        tip_jacobians: Geometric Jacobians of the tips (4.1).
        surface_points: Contacts on the object, object frame, m.
        surface_tangents: [c_u, c_v] there, object frame.
        surface_normals: Outward normals, object frame.
        surface_spins: Matrices C of (4.4), object frame.
        object_positions: The object's origin as each extended finger has it, m.
        object_rotations: Its orientation.
        levers: From the object's origin to the tips, m.
        xi_jacobians: Rates of the contact coordinates per unit of the variables.
        jacobian: Stacked extended Jacobian Jt of (4.9).
    """

    joints: Annotated[FloatArray, "joints"]
    contact_variables: Annotated[FloatArray, "contacts", 5]
    joint_rotations: Annotated[FloatArray, "joints", 3, 3]
    joint_origins: Annotated[FloatArray, "joints", 3]
    joint_axes: Annotated[FloatArray, "joints", 3]
    tip_positions: Annotated[FloatArray, "contacts", 3]
    tip_rotations: Annotated[FloatArray, "contacts", 3, 3]
    tip_jacobians: Annotated[FloatArray, "contacts", 6, "joints"]
    surface_points: Annotated[FloatArray, "contacts", 3]
    surface_tangents: Annotated[FloatArray, "contacts", 3, 2]
    surface_normals: Annotated[FloatArray, "contacts", 3]
    surface_spins: Annotated[FloatArray, "contacts", 3, 2]
    object_positions: Annotated[FloatArray, "contacts", 3]
    object_rotations: Annotated[FloatArray, "contacts", 3, 3]
    levers: Annotated[FloatArray, "contacts", 3]
    xi_jacobians: Annotated[FloatArray, "contacts", 2, "variables"]
    jacobian: Annotated[FloatArray, "stacked_rows", "variables"]


class LawArrays(Record):
    """A control law's settings, its result, and room to work.

    Attributes:
        transpose: 1 for the transpose algorithm (4.12), 0 for the pseudo-inverse (4.10).
        limited: 1 for the QP form, which needs the null space whether there are tasks or not.
        singular_threshold: Smallest singular value below which damping begins.
        largest_damping: Damping factor at a singularity.
        gain: Diagonal of K, 1/s.
        scale: 1 / sqrt(weight) of the variables.
        errors: Pose errors, one loop a finger.
        wanted: G^T (v_d + K e), contacts stacked.
        velocity: z'.
        led_rates: xi' of contacts that are led over the surface; 0 for all others.
        contact_rates: [xi'; theta'].
        factors: LQ factors of Jt, group by group.
        heads: Heads of their reflectors.
        basis: Orthonormal basis of the main task's null space, one motion a row.
        projector: On what the tasks so far leave of it, in that basis.
        row: Room for one row.
        row_along_basis: Room for its part along the basis.
    """

    transpose: int
    limited: int
    singular_threshold: float
    largest_damping: float
    gain: Annotated[FloatArray, 6]
    scale: Annotated[FloatArray, "variables"]
    errors: Annotated[FloatArray, "contacts", 6]
    wanted: Annotated[FloatArray, "stacked_rows"]
    velocity: Annotated[FloatArray, "variables"]
    led_rates: Annotated[FloatArray, "contacts", 2]
    contact_rates: Annotated[FloatArray, "contacts", 5]
    factors: Annotated[FloatArray, "stacked_rows", "variables"]
    heads: Annotated[FloatArray, "stacked_rows"]
    basis: Annotated[FloatArray, "free", "variables"]
    projector: Annotated[FloatArray, "free", "free"]
    row: Annotated[FloatArray, "variables"]
    row_along_basis: Annotated[FloatArray, "free"]


class TaskArrays(Record):
    """A secondary task: what all of them have, and their rows at a state.

    A compiled task's own class adds what its kernel reads.

    Attributes:
        gain: K of the errors, 1/s.
        start_s: When the task enters.
        end_s: When it begins to leave.
        ramp_s: How long both take.
        values: f(q, eta).
        errors: Desired minus actual value; the control step multiplies it by the gain.
        activations: 0 (off) to 1 (on); the control step multiplies it by the task's presence.
        jacobian: Derivative of the values with respect to the variables.
    """

    gain: float
    start_s: float
    end_s: float
    ramp_s: float
    values: Annotated[FloatArray, "rows"]
    errors: Annotated[FloatArray, "rows"]
    activations: Annotated[FloatArray, "rows"]
    jacobian: Annotated[FloatArray, "rows", "variables"]


class TaskTable(Record):
    """All tasks of a law.

    Attributes:
        kernels: Address of each task's kernel, 0 for a task in Python, whose rows are there already.
        blocks: Address of its `TaskArrays`.
        separate: 1 if every row comes and goes on its own.
        counts: Rows now.
        activations: Largest activation of each task's rows.
    """

    kernels: Annotated[IntArray, "tasks"]
    blocks: Annotated[IntArray, "tasks"]
    separate: Annotated[IntArray, "tasks"]
    counts: Annotated[IntArray, "tasks"]
    activations: Annotated[FloatArray, "tasks"]
