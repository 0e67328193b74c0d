"""Meshes that nobody wants: each is refused or repaired with one clear sentence."""

import numpy as np
import pytest
import trimesh

from graspbench.errors import MeshError
from graspbench.geometry import ObjectParameters, check_mesh, load_object, repair_mesh
from tests.geometry.bad_meshes import (
    at,
    ball,
    box,
    drilled,
    fan_book,
    mesh,
    moebius,
    one_sentence,
    pushed_through,
    solid,
    surface,
    together,
    torus,
    touching_triangles,
    turned,
    walled_box,
    with_handle,
    with_vertex,
    without,
)

REFUSED = "refused"
TOUCHING = touching_triangles(ball())
PLACES = (0.0, 0.012, 0.024)
TUBE = trimesh.creation.cylinder(0.02, 0.08)

# fmt: off
# name: (mesh, kind of the first problem or None when usable, words of the repair or REFUSED)
MESHES = {
    "one triangle": (mesh([[0, 0, 0], [0.05, 0, 0], [0, 0.05, 0]], [[0, 1, 2]]), "flat", REFUSED),
    "one hole": (without(ball(), np.arange(768) != 5), "open", "1 hole was closed"),
    "many holes": (without(ball(), np.arange(768) % 50 != 5), "open", "holes were closed"),
    "half a ball": (without(ball(), ball().triangles_center[:, 2] < 0.0), "open", "1 hole was closed"),
    "box without lid": (without(box(), box().face_normals[:, 2] < 0.5), "open", "1 hole was closed"),
    "tube without ends": (
        without(TUBE, np.abs(TUBE.face_normals[:, 2]) < 0.5),
        "open",
        "2 holes were closed",
    ),
    "sheet": (without(box().subdivide(), box().subdivide().face_normals[:, 2] > 0.5), "flat", REFUSED),
    "inside out": (mesh(ball().vertices, ball().faces[:, ::-1]), None, "inside out"),
    "a third inverted": (turned(ball(), 0.33), None, "inverted triangles were turned"),
    "half inverted": (turned(ball(), 0.5), None, "inverted triangles were turned"),
    "one inverted": (turned(ball(), 0.002), None, "1 inverted triangle was turned"),
    "flat box": (box(0.05, 0.05, 1e-9), "flat", REFUSED),
    "flattened ball": (mesh(ball().vertices * [1, 1, 0], ball().faces), "flat", REFUSED),
    "needle": (box(0.1, 1e-5, 1e-5), "flat", REFUSED),
    "all in one point": (mesh(np.zeros((8, 3)), box().faces), "flat", REFUSED),
    "all on one line": (mesh(ball().vertices * [1, 0, 0], ball().faces), "flat", REFUSED),
    "a vertex is nan": (with_vertex(ball(), 7, np.nan), "nan", "1 hole was closed"),
    "a vertex is infinite": (with_vertex(ball(), 7, np.inf), "nan", "1 hole was closed"),
    "all nan": (mesh(np.full((8, 3), np.nan), box().faces), "nan", REFUSED),
    "in millimetres": (box(40, 50, 60), "units", REFUSED),
    "in centimetres": (box(14, 15, 16), "units", REFUSED),
    "in inches": (box(5, 6, 7), "units", REFUSED),
    "in kilometres": (box(4e-5, 5e-5, 6e-5), "units", REFUSED),
    "as large as a house": (box(9e9, 8e9, 9e9), "units", REFUSED),
    "torus": (torus(1), None, ""),
    "two handles": (torus(2), None, ""),
    "three handles": (torus(3), None, ""),
    "thin tunnel": (drilled(ball(), 0.0008), "genus", "1 spurious handle was cut, 5.0 mm around"),
    "thin handle": (with_handle(0.0006), "genus", "1 spurious handle was cut, 3.7 mm around"),
    "thin tunnel in a ring": (drilled(at(torus(), 0.03, 0, 0), 0.0008), "genus", "1 spurious handle was cut"),
    "two equal bodies": (together(box(), at(box(), 0.2, 0, 0)), "bodies", REFUSED),
    "ten equal bodies": (together(*(at(ball(0.01), 0.05 * k, 0, 0) for k in range(10))), "bodies", REFUSED),
    "stray crumb": (together(ball(), at(ball(0.002), 0.05, 0, 0)), "bodies", "1 stray piece was dropped"),
    "overlapping boxes": (together(box(), at(box(), 0.02, 0.01, 0.015)), "bodies", "joined into 1"),
    "ball in a ball": (together(ball(), ball(0.02)), "bodies", "joined into 1"),
    "cavity": (together(ball(), mesh(ball(0.02).vertices, ball().faces[:, ::-1])), "bodies", "joined into 1"),
    "boxes that share a face": (together(box(), at(box(), 0.04, 0, 0)), "non_manifold", "joined into 1"),
    "boxes that share an edge": (together(box(), at(box(), 0.04, 0.05, 0)), "non_manifold", REFUSED),
    "boxes that share a corner": (together(box(), at(box(), 0.04, 0.05, 0.06)), "bodies", REFUSED),
    "pushed through itself": (pushed_through(), "self_intersecting", REFUSED),
    "moebius strip": (moebius(), "open", REFUSED),
    "three sheets in one edge": (fan_book(), "open", REFUSED),
    "wall inside": (walled_box(), "non_manifold", "joined into 1"),
    "every triangle twice": (mesh(ball().vertices, np.vstack([ball().faces] * 2)), None, "768 degenerate or"),
    "holes that touch": (without(ball(), ~np.isin(np.arange(768), TOUCHING)), "open", "2 holes were"),
    "both sides of everything": (
        mesh(ball().vertices, np.vstack([ball().faces, ball().faces[:, ::-1]])),
        None,
        "768 triangles were dropped that repeated another one's back",
    ),
    "as large as numbers go": (mesh(1e300 * ball().vertices, ball().faces), "units", REFUSED),
    "unmerged corners": (mesh(ball().triangles.reshape(-1, 3), np.arange(768 * 3).reshape(-1, 3)), None, ""),
    "triangle soup": (
        mesh(np.random.default_rng(1).uniform(-0.05, 0.05, (300, 3)), np.arange(300).reshape(-1, 3)),
        "open",
        REFUSED,
    ),
}
# fmt: on
GENUS = {"torus": 1, "two handles": 2, "three handles": 3, "thin tunnel in a ring": 1}


@pytest.mark.parametrize("name", MESHES)
def test_bad_meshes_are_refused_or_repaired(name, tmp_path):
    bad, kind, repair = MESHES[name]
    report = check_mesh(bad, name=name)
    assert report.usable == (kind is None)
    if kind is None:
        assert any(repair in done for done in report.repairs) or repair == ""
    else:
        assert report.problems[0].kind == kind, [str(problem) for problem in report.problems]
        assert all(one_sentence(str(problem)) for problem in report.problems)
        assert name in str(report.problems[0])
    if repair == REFUSED:
        with pytest.raises(MeshError) as caught:
            repair_mesh(bad, name=name)
        assert one_sentence(str(caught.value))
    else:
        fixed, after = repair_mesh(bad, name=name)
        assert any(repair in done for done in after.repairs) or repair == "", after.repairs
        again = check_mesh(fixed)
        assert again.usable
        assert not again.repairs
        assert (again.bodies, again.genus, again.watertight) == (1, GENUS.get(name, 0), True)
        assert fixed.volume > 0.0


@pytest.mark.parametrize(
    "name", ["one hole", "thin tunnel", "two equal bodies", "in millimetres", "pushed through itself"]
)
def test_a_trial_refuses_them_by_the_same_sentence(name, tmp_path):
    path = tmp_path / "bad.ply"
    MESHES[name][0].export(path)
    with pytest.raises(MeshError) as caught:
        load_object(ObjectParameters(mesh=str(path)))
    assert str(caught.value) == str(check_mesh(path).problems[0])
    assert caught.value.data["kind"] == MESHES[name][1]


def test_a_wide_hole_is_closed_with_a_warning_a_gap_without():
    assert not repair_mesh(MESHES["one hole"][0])[1].warnings
    (warning,) = repair_mesh(MESHES["half a ball"][0])[1].warnings
    assert "60 mm wide was closed by a guess" in warning


def test_many_spurious_handles_are_cut_at_once_and_said_once():
    # Two plates that a wall holds together, with thin struts between.
    body = trimesh.creation.box((0.08, 0.08, 0.004))
    struts = [
        at(trimesh.creation.cylinder(0.0008, 0.02, sections=8), x, y, 0.01) for x in PLACES for y in PLACES
    ]
    plates = solid(body) + solid(at(body, 0, 0, 0.02)) + solid(at(box(0.02, 0.08, 0.02), -0.03, 0, 0.01))
    for strut in struts:
        plates += solid(strut)
    fixed, report = repair_mesh(surface(plates))
    assert report.genus == 0
    (done,) = [repair for repair in report.repairs if "handle" in repair]
    assert done.startswith(f"{len(struts)} spurious handles were cut, ")
    assert fixed.volume == pytest.approx(2 * 0.08**2 * 0.004 + 0.02 * 0.08 * 0.016, rel=0.02)
