import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from graspbench.errors import ConfigurationError, MeshError
from graspbench.geometry.convex_union import hull_mesh, to_manifold
from graspbench.geometry.inspection import inspect
from graspbench.geometry.mesh import signed_volume
from graspbench.geometry.revolution import SEGMENTS, convex_slices, revolved_body
from graspbench.geometry.shapes import SHAPES, make_shape

CONES = {"height_m": 0.1, "bottom_diameter_m": 0.08, "top_diameter_m": 0.04, "edge_radius_m": 0.0}
NEEDS = {
    "revolution": {"corners_m": [[0, 0], [0.03, 0], [0.02, 0.08], [0, 0.08]], "radii_m": [0.002, 0.004]},
    "extrusion": {"corners_m": [[0, 0], [0.06, 0], [0.05, 0.05], [0, 0.05]]},
    "union": {
        "members": [
            {"shape": {"kind": "superquadric"}},
            {"shape": {"kind": "superquadric"}, "at_m": [0.03, 0.0, 0.0]},
        ]
    },
}


def volume(mesh):
    return signed_volume(np.asarray(mesh.vertices), np.asarray(mesh.faces))


def polygon_share(n=SEGMENTS):
    """Area of a regular n-gon, as a share of its circumcircle's."""
    return n * math.sin(2.0 * math.pi / n) / (2.0 * math.pi)


def superellipsoid_volume(size, e1, e2):
    """Jaklic, Leonardis, Solina 2000: 2 a b c e1 e2 B(e1/2 + 1, e1) B(e2/2, e2/2)."""

    def beta(p, q):
        return math.gamma(p) * math.gamma(q) / math.gamma(p + q)

    a, b, c = (0.5 * s for s in size)
    return 2.0 * a * b * c * e1 * e2 * beta(e1 / 2 + 1, e1) * beta(e2 / 2, e2 / 2)


@pytest.mark.parametrize("kind", SHAPES.names())
def test_every_kind_is_one_closed_body_of_genus_0_that_its_parts_cover(kind):
    body = make_shape({"kind": kind, **NEEDS.get(kind, {})}).build()
    vertices, faces = np.asarray(body.mesh.vertices), np.asarray(body.mesh.faces)
    cleaned, triangles, report = inspect(vertices, faces, kind, trusted=True)
    assert report.usable, report.problems
    assert report.genus == 0
    assert volume(body.mesh) > 0.0
    for part in body.parts or ():
        hull = hull_mesh(np.asarray(part.vertices))
        assert volume(part) == pytest.approx(volume(hull), rel=1e-3)
    if body.parts:
        solids = [to_manifold(part.vertices, part.faces) for part in body.parts]
        missing = to_manifold(cleaned, triangles)
        for solid in solids:
            missing = missing - solid
        assert missing.volume() < 0.012 * volume(body.mesh)


@pytest.mark.parametrize("kind", ["cone", "bottle", "prism", "superquadric", "glass"])
def test_generated_surfaces_do_not_intersect_themselves(kind):
    mesh = make_shape({"kind": kind}).build().mesh
    report = inspect(np.asarray(mesh.vertices), np.asarray(mesh.faces), kind)[2]
    assert report.self_intersecting == 0
    assert not report.repairs


def test_a_truncated_cone_has_its_volume():
    mesh = make_shape({"kind": "cone", **CONES}).build().mesh
    expected = math.pi * 0.1 / 3.0 * (0.04**2 + 0.04 * 0.02 + 0.02**2) * polygon_share()
    assert volume(mesh) == pytest.approx(expected, rel=1e-9)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.3, 1.9), st.floats(0.3, 1.9))
def test_superquadrics_have_their_volume_and_size(e1, e2):
    size = [0.05, 0.06, 0.08]
    shape = {"kind": "superquadric", "size_m": size, "vertical_exponent": e1, "horizontal_exponent": e2}
    mesh = make_shape(shape).build().mesh
    assert volume(mesh) == pytest.approx(superellipsoid_volume(size, e1, e2), rel=0.02)
    np.testing.assert_allclose(np.ptp(mesh.vertices, axis=0), size, rtol=1e-6)


def test_a_prism_with_sharp_edges_has_its_volume():
    shape = {"kind": "prism", "sides": 5, "circumradius_m": 0.04, "height_m": 0.07}
    mesh = make_shape({**shape, "corner_radius_m": 0.0, "rim_radius_m": 0.0}).build().mesh
    area = 0.5 * 5 * 0.04**2 * math.sin(2.0 * math.pi / 5)
    assert volume(mesh) == pytest.approx(area * 0.07, rel=1e-9)


def test_the_smooth_prism_has_three_flat_sides_and_round_corners():
    mesh = make_shape({"kind": "prism", "sides": 3}).build().mesh
    sides = np.abs(mesh.face_normals[:, 2]) < 1e-6
    angle = np.degrees(np.arctan2(mesh.face_normals[sides, 1], mesh.face_normals[sides, 0]))
    area = mesh.area_faces[sides]
    flat = sum(area[np.abs((angle - at + 180) % 360 - 180) < 0.1].sum() for at in (60.0, 180.0, -60.0))
    assert 0.4 < flat / area.sum() < 0.8


def test_an_egg_is_widest_below_its_middle():
    mesh = make_shape({"kind": "egg", "height_m": 0.08, "diameter_m": 0.06, "taper": 0.2}).build().mesh
    radius = np.linalg.norm(mesh.vertices[:, :2], axis=1)
    assert radius.max() == pytest.approx(0.03)
    assert mesh.vertices[np.argmax(radius), 2] < 0.04
    assert np.ptp(mesh.vertices[:, 2]) == pytest.approx(0.08)


def test_a_glass_has_its_cavity():
    shape = {
        "height_m": 0.1,
        "bottom_diameter_m": 0.06,
        "top_diameter_m": 0.06,
        "wall_m": 0.004,
        "bottom_m": 0.01,
    }
    glass = make_shape({"kind": "glass", **shape}).build()
    expected = math.pi * (0.03**2 * 0.1 - 0.026**2 * 0.09) * polygon_share()
    assert volume(glass.mesh) == pytest.approx(expected, rel=0.02)


@settings(max_examples=25, deadline=None)
@given(
    st.lists(
        st.tuples(st.floats(0.005, 0.05), st.floats(0.005, 0.05), st.booleans(), st.floats(0.003, 0.02)),
        min_size=2,
        max_size=6,
    )
)
def test_slices_of_any_rising_profile_are_convex_and_cover_it(rows):
    points, height = [(0.0, 0.0)], 0.0
    for i, (radius, other, ledge, step) in enumerate(rows):
        points.append((radius, height))
        if ledge and abs(other - radius) > 1e-3 and 0 < i < len(rows) - 1:
            points.append((other, height))
        height += step if i < len(rows) - 1 else 0.0
    profile = np.array([*points, (0.0, height)])
    slices = convex_slices(profile, 24)
    whole = volume(revolved_body(profile, 24).mesh)
    # Every slice may bulge out of its concave side by the tolerance of 0.3 mm.
    bulge = 3e-4 * 2.0 * math.pi * 0.05 * height
    assert 0.985 * whole <= sum(volume(part) for part in slices) <= whole + bulge
    for part in slices:
        assert volume(part) == pytest.approx(volume(hull_mesh(np.asarray(part.vertices))), rel=1e-3)


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        ({}, "no kind"),
        ({"kind": "dodecahedron"}, "unknown shape 'dodecahedron'"),
        ({"kind": "bottle", "hight_m": 0.2}, "unknown parameter 'hight_m'"),
        ({"kind": "bottle", "height_m": -0.2}, "height_m = -0.2"),
        ({"kind": "bottle", "height_m": "tall"}, "height_m = 'tall'"),
        ({"kind": "bottle", "neck_diameter_m": 0.07}, "neck thinner"),
        ({"kind": "bottle", "neck_height_m": 0.2}, "neck thinner"),
        ({"kind": "cone", "edge_radius_m": 0.05}, "does not fit"),
        ({"kind": "prism", "sides": 2}, "sides = 2"),
        ({"kind": "prism", "rim_radius_m": 0.05}, "rounder than half"),
        ({"kind": "prism", "inner_radius_m": 0.06}, "inner corners"),
        ({"kind": "glass", "wall_m": 0.02}, "no room"),
        ({"kind": "bent_tube", "bend_deg": 180, "diameter_m": 0.1, "length_m": 0.1}, "bent more sharply"),
        ({"kind": "extrusion", "corners_m": [[0, 0], [0, 0.05], [0.05, 0]]}, "clockwise"),
        ({"kind": "revolution", "corners_m": [[0, 0], [0.03, 0], [0, 0.1]], "radii_m": []}, "one radius"),
        (
            {"kind": "revolution", "corners_m": [[0.01, 0], [0.03, 0], [0, 0.1]], "radii_m": [0]},
            "on the axis",
        ),
        ({"kind": "union", "members": [{"shape": {"kind": "egg"}}]}, "members"),
    ],
)
def test_descriptions_that_make_no_sense_are_refused_in_one_sentence(shape, words):
    with pytest.raises(ConfigurationError) as caught:
        make_shape(shape).build()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_members_that_do_not_touch_are_no_union():
    far = {"shape": {"kind": "egg"}, "at_m": [0.5, 0.0, 0.0]}
    with pytest.raises(MeshError, match="2 surfaces"):
        make_shape({"kind": "union", "members": [{"shape": {"kind": "egg"}}, far]}).build()


def test_building_twice_gives_the_same_bits():
    for kind in ("bottle", "lobed", "superquadric", "pybullet_parts"):
        first, second = (make_shape({"kind": kind}).build() for _ in range(2))
        np.testing.assert_array_equal(first.mesh.vertices, second.mesh.vertices)
        np.testing.assert_array_equal(first.mesh.faces, second.mesh.faces)
