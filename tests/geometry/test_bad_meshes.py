"""Fifty meshes that nobody wants: each is refused or repaired with one clear sentence."""

import json
import struct

import manifold3d
import numpy as np
import pytest
import trimesh

from graspbench.errors import ConfigurationError, MeshError
from graspbench.geometry import (
    ObjectParameters,
    check_mesh,
    load_mesh,
    load_object,
    repair_mesh,
    topology,
)
from graspbench.geometry.handles import cut_open, thinnest_loop
from graspbench.geometry.star_surface import cube_sphere

REFUSED = "refused"


def mesh(vertices, faces):
    return trimesh.Trimesh(np.array(vertices, dtype=float), np.array(faces), process=False, validate=False)


def ball(radius=0.03, cells=8):
    points, faces = cube_sphere(cells)
    return mesh(radius * points / np.linalg.norm(points, axis=1, keepdims=True), faces)


def box(*size):
    return trimesh.creation.box(size or (0.04, 0.05, 0.06))


def at(body, *offset):
    return body.copy().apply_translation(offset)


def together(*bodies):
    return trimesh.util.concatenate(list(bodies))


def without(body, keep):
    return mesh(body.vertices, body.faces[keep])


def solid(m):
    return manifold3d.Manifold(manifold3d.Mesh(np.array(m.vertices, "f4"), np.array(m.faces, "u4")))


def surface(body):
    out = body.to_mesh()
    return mesh(out.vert_properties[:, :3], out.tri_verts)


def torus(handles=1):
    """Return rings that overlap in a row: genus 1 each."""
    ring = trimesh.creation.torus(0.03, 0.008, major_sections=24, minor_sections=12)
    if handles == 1:
        return ring
    union = solid(ring)
    for k in range(1, handles):
        union += solid(at(ring, 0.055 * k, 0.0, 0.002))
    return surface(union)


def drilled(body, radius):
    return surface(solid(body) - solid(trimesh.creation.cylinder(radius, 0.2)))


def with_handle(radius):
    ring = trimesh.creation.torus(4.0 * radius, radius, major_sections=24, minor_sections=12)
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0], [0, 0, 0])
    return surface(solid(ball()) + solid(at(ring.apply_transform(turn), 0.03, 0, 0)))


def with_vertex(body, index, value):
    points = np.array(body.vertices)
    points[index] = value
    return mesh(points, body.faces)


def turned(body, share):
    faces = np.array(body.faces)
    some = np.random.default_rng(0).random(len(faces)) < share
    faces[some] = faces[some][:, ::-1]
    return mesh(body.vertices, faces)


def pushed_through():
    body = ball(0.03, 10)
    points = np.array(body.vertices)
    points[points[:, 0] > 0.02, 0] -= 0.055
    return mesh(points, body.faces)


def moebius(n=24):
    angle = 2 * np.pi * np.arange(n) / n
    rim = [
        [
            (0.04 + s * 0.01 * np.cos(a / 2)) * np.cos(a),
            (0.04 + s * 0.01 * np.cos(a / 2)) * np.sin(a),
            s * 0.01 * np.sin(a / 2),
        ]
        for a in angle
        for s in (-1, 1)
    ]
    faces = []
    for i in range(n):
        a, b, c, d = 2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 3
        if i == n - 1:
            c, d = 1, 0
        faces += [[a, c, b], [b, c, d]]
    return mesh(rim, faces)


def fan_book():
    """Return three sheets that meet in one edge."""
    return mesh(
        [[0, 0, 0], [0, 0, 0.05], [0.05, 0, 0], [-0.03, 0.04, 0], [-0.03, -0.04, 0]],
        [[0, 1, 2], [0, 1, 3], [0, 1, 4]],
    )


def walled_box():
    """Return a box with a wall inside."""
    body = trimesh.creation.box((0.04, 0.04, 0.04)).subdivide()
    ring = np.flatnonzero(np.abs(body.vertices[:, 2]) < 1e-9)
    angle = np.argsort(np.arctan2(body.vertices[ring, 1], body.vertices[ring, 0]))
    rim = ring[angle]
    wall = [[rim[i], rim[(i + 1) % len(rim)], len(body.vertices)] for i in range(len(rim))]
    return mesh(np.vstack([body.vertices, [[0, 0, 0]]]), np.vstack([body.faces, wall]))


def touching_triangles(body):
    """Return two triangles that share one corner and nothing else."""
    corner = body.faces[0, 0]
    for other in np.flatnonzero((body.faces == corner).any(axis=1)):
        if len(set(body.faces[0]) | set(body.faces[other])) == 5:
            return (0, other)
    raise AssertionError


TOUCHING = touching_triangles(ball())
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
    "thin tunnel": (drilled(ball(), 0.0008), "genus", "a spurious handle was cut, 5.0 mm around"),
    "thin handle": (with_handle(0.0006), "genus", "a spurious handle was cut, 3.7 mm around"),
    "thin tunnel in a ring": (drilled(at(torus(), 0.03, 0, 0), 0.0008), "genus", "a spurious handle was cut"),
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

HANDLES = {"torus": 1, "two handles": 2, "three handles": 3, "thin tunnel in a ring": 1}
"""Handles that are meant and stay."""

BINARY_STL = b"x" * 80
ASCII_STL = trimesh.exchange.stl.export_stl_ascii(box()).encode()


def glb(content):
    text = json.dumps(content).encode()
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text


FILES = {
    "nothing.stl": (b"", "empty", "empty file"),
    "text.obj": (b"I am not a mesh.\n", None, "holds no"),
    "points only.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "empty", "points but no triangles"),
    "missing corner.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "broken", ""),
    "picture.stl": (b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 4, None, ""),
    "cut off.stl": (BINARY_STL + struct.pack("<I", 100) + bytes(70), "broken", "cut off"),
    "millions of nothing.stl": (BINARY_STL + struct.pack("<I", 2**31), "broken", "0 of 2147483648 triangles"),
    "header.ply": (b"ply\nformat ascii 1.0\nelement vertex 10\n", "broken", "cut off or broken"),
    "endless.ply": (
        b"ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nelement face 99999999999\nend_header\n",
        "too_large",
        "array of 99999999999",
    ),
    "endless.glb": (glb({"accessors": [{"count": 10**12}]}), "too_large", "array of 1000000000000"),
    "corner zero.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "broken", "line 4 has a corner"),
    "plane.obj": (b"v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n", "broken", "'0 0' is no point"),
    "cut off text.stl": (ASCII_STL[: len(ASCII_STL) // 2], "broken", "cut off before endsolid"),
    "comma.stl": (ASCII_STL.replace(b".", b","), "broken", "is no point"),
    "cut off.off": (b"OFF\n3 1 0\n0 0 0\n1 0 0\n", "broken", "cut off before its 3 vertices"),
    "page.stl": (b"<!DOCTYPE html><html>404</html>", "broken", "web page"),
    "pointer.obj": (b"version https://git-lfs.github.com/spec/v1\n", "broken", "Git LFS"),
    "archive.ply": (b"PK\x03\x04" + bytes(99), "broken", "zip archive"),
    "words.off": (b"OFF\n3 1 0\na b c\n", "broken", "cannot be read"),
    "wrong.glb": (b"glTF\x02\x00\x00\x00\xff\xff\xff\x7f" + bytes(40), "broken", "cannot be read"),
    "drawing.step": (b"ISO-10303-21;", "format", "no mesh format"),
}


def one_sentence(text):
    return text.endswith(".") and "\n" not in text and "Traceback" not in text and 10 < len(text) < 260


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
        assert (again.bodies, again.genus, again.watertight) == (1, HANDLES.get(name, 0), True)
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


@pytest.mark.parametrize("name", FILES)
def test_files_that_are_no_mesh_are_refused(name, tmp_path):
    content, kind, words = FILES[name]
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(MeshError) as caught:
        load_mesh(path)
    assert one_sentence(str(caught.value)), str(caught.value)
    assert words in str(caught.value)
    assert name in str(caught.value)
    if kind is not None:
        assert caught.value.data["kind"] == kind
    assert not check_mesh(path).usable


@pytest.mark.parametrize(("handles", "left"), [(1, 0), (2, 1), (3, 2)])
def test_the_thinnest_loop_goes_around_the_tube_and_its_cut_removes_one_handle(handles, left):
    body = torus(handles)
    vertices, faces = topology.weld(np.array(body.vertices), np.array(body.faces))
    loop, girth = thinnest_loop(vertices, faces)
    assert girth == pytest.approx(24 * 0.008 * np.sin(np.pi / 12), rel=1e-3)  # a regular polygon of 12 sides
    assert len(loop) == 12
    opened, cut = cut_open(vertices, faces, loop)
    edges = topology.find_edges(cut, len(opened))
    assert np.sum(edges.count == 1) == 24
    # Two discs close it: each adds a vertex, and a triangle for each edge of its rim.
    assert topology.genus(len(opened) + 2, len(cut) + 24) == left


def test_there_are_fifty():
    assert len(MESHES) + len(FILES) >= 50


def test_missing_files_and_folders(tmp_path):
    with pytest.raises(MeshError, match="no mesh file"):
        load_mesh(tmp_path / "none.stl")
    with pytest.raises(MeshError, match="is not a file"):
        load_mesh(tmp_path)


@pytest.mark.parametrize(
    ("factor", "scale"), [(1000.0, "0.001"), (100.0, "0.01"), (1 / 0.0254, "0.0254"), (1e-3, "1000")]
)
def test_wrong_units_come_with_a_scale_to_try(factor, scale):
    size = 0.15 if scale in ("0.01", "0.0254") else 0.06
    report = check_mesh(box(*(factor * size * np.array([1.0, 0.7, 0.5]))))
    (problem,) = report.problems
    assert f"object.scale={scale}" in str(problem) or scale == "0.0254"


@pytest.mark.parametrize(
    ("factor", "unit"),
    [(1.0, "metres"), (1000.0, "millimetres"), (100.0, "centimetres"), (1e-3, "kilometres")],
)
def test_units_are_guessed_on_request_with_a_warning(factor, unit, tmp_path):
    path = tmp_path / "brick.ply"
    box(*(factor * np.array([0.1, 0.07, 0.05]))).export(path)
    model = load_object(ObjectParameters(mesh=str(path), scale="guess"))
    np.testing.assert_allclose(model.extents_m, [0.1, 0.07, 0.05], rtol=1e-5)
    (warning,) = model.report.warnings
    assert f"guessed to be in {unit}" in warning
    assert "100 mm" in warning
    assert not load_object(ObjectParameters(mesh=str(path), scale=1.0 / factor)).report.warnings


def test_no_unit_is_guessed_for_a_house_or_for_a_shape(tmp_path):
    path = tmp_path / "house.ply"
    box(9e9, 8e9, 9e9).export(path)
    assert "no usual unit" in str(check_mesh(path, scale="guess").problems[0])
    with pytest.raises(ConfigurationError, match="whose size is known"):
        load_object(ObjectParameters(name="sphere", scale="guess"))


def test_a_wide_hole_is_closed_with_a_warning_a_gap_without():
    assert not repair_mesh(MESHES["one hole"][0])[1].warnings
    (warning,) = repair_mesh(MESHES["half a ball"][0])[1].warnings
    assert "60 mm wide was closed by a guess" in warning


def test_text_in_utf_16_and_trailing_bytes_are_read(tmp_path):
    path = tmp_path / "box.stl"
    for content in (
        ASCII_STL.decode().encode("utf-16"),
        ASCII_STL.replace(b"\n", b"\r\n"),
        trimesh.exchange.stl.export_stl(box()) + bytes(300),
        b"solid with a binary body".ljust(80) + trimesh.exchange.stl.export_stl(box())[80:],
    ):
        path.write_bytes(content)
        assert load_mesh(path).volume == pytest.approx(box().volume, rel=1e-5)


def test_obj_polygons_count_from_both_ends(tmp_path):
    path = tmp_path / "pyramid.obj"
    path.write_text(
        "mtllib none.mtl\nv 0 0 0 1 0 0\nv .04 0 0\nv .04 .04 0\nv 0 .04 0\nvn 0 0 1\nv .02 .02 .03\n"
        "f 4//1 3//1 2//1 1//1\nf -5 -4 -1\nf 2/7 3/7 5/7\nf 3 4 5\nf 4 1 5 # the last\n"
    )
    mesh = load_mesh(path)
    assert (len(mesh.vertices), len(mesh.faces)) == (5, 6)
    assert mesh.volume == pytest.approx(0.04**2 * 0.03 / 3)


def test_a_part_of_random_bytes_never_crashes(tmp_path):
    rng = np.random.default_rng(5)
    sound = ball(cells=2)
    for suffix in ("stl", "ply", "obj", "off", "glb"):
        path = tmp_path / f"fuzz.{suffix}"
        sound.export(path)
        good = path.read_bytes()
        for _ in range(12):
            broken = bytearray(good[: rng.integers(1, len(good) + 1)])
            for position in rng.integers(0, len(broken), 4):
                broken[position] = rng.integers(0, 256)
            path.write_bytes(bytes(broken))
            report = check_mesh(path)
            assert report.usable or all(one_sentence(str(problem)) for problem in report.problems)


def test_a_fine_mesh_is_simplified_within_a_tenth_of_a_millimetre(tmp_path):
    fine = ball(0.03, 44)
    path = tmp_path / "fine.stl"
    fine.export(path)
    simple = load_mesh(path)
    assert len(simple.faces) <= 20_000 < len(fine.faces)
    assert simple.volume == pytest.approx(fine.volume, rel=2e-3)
    np.testing.assert_allclose(np.linalg.norm(simple.vertices, axis=1), 0.03, atol=1e-4)
    assert "simplified" in check_mesh(path).repairs[0]


@pytest.mark.parametrize("suffix", ["obj", "stl", "ply", "glb", "off"])
def test_every_format_is_read_alike(suffix, tmp_path):
    path = tmp_path / f"ball.{suffix.upper()}"
    ball().export(path, file_type=suffix)
    loaded = load_mesh(path, 2.0)
    assert (len(loaded.vertices), len(loaded.faces)) == (386, 768)
    assert loaded.volume == pytest.approx(8.0 * ball().volume, rel=1e-5)
