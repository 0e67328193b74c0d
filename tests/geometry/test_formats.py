"""Mesh files of every format, with the liberties that their formats allow."""

import struct

import numpy as np
import pytest
import trimesh

from graspbench.errors import MeshError
from graspbench.geometry import check_mesh, load_mesh
from tests.geometry.bad_meshes import ASCII_STL, ball, box


@pytest.mark.parametrize("suffix", ["obj", "stl", "ply", "glb", "off"])
def test_every_format_is_read_alike(suffix, tmp_path):
    path = tmp_path / f"ball.{suffix.upper()}"
    ball().export(path, file_type=suffix)
    loaded = load_mesh(path, 2.0)
    assert (len(loaded.vertices), len(loaded.faces)) == (386, 768)
    assert loaded.volume == pytest.approx(8.0 * ball().volume, rel=1e-5)


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


def test_a_fine_mesh_is_simplified_within_a_tenth_of_a_millimetre(tmp_path):
    fine = ball(0.03, 44)
    path = tmp_path / "fine.stl"
    fine.export(path)
    simple = load_mesh(path)
    assert len(simple.faces) <= 20_000 < len(fine.faces)
    assert simple.volume == pytest.approx(fine.volume, rel=2e-3)
    np.testing.assert_allclose(np.linalg.norm(simple.vertices, axis=1), 0.03, atol=1e-4)
    assert "simplified" in check_mesh(path).repairs[0]


L_SHAPE = [(0, 0), (60, 0), (60, 20), (40, 20), (20, 20), (20, 60), (0, 60), (0, 30)]
"""A concave outline, with a corner on each of two straight sides."""


def prism(first):
    """Return the prism over the outline, whose first corner is another one of it: vertices and polygons."""
    outline = L_SHAPE[first:] + L_SHAPE[:first]
    n = len(outline)
    vertices = [(x, y, z) for z in (0, 45) for x, y in outline]
    sides = [(k, (k + 1) % n, n + (k + 1) % n, n + k) for k in range(n)]
    return vertices, [tuple(reversed(range(n))), tuple(range(n, 2 * n)), *sides]


def as_obj(vertices, polygons, path):
    lines = [f"v {x} {y} {z}" for x, y, z in vertices]
    lines += ["f " + " ".join(str(k + 1) for k in p) for p in polygons]
    path.with_suffix(".obj").write_text("\n".join(lines))
    return path.with_suffix(".obj")


def as_off(vertices, polygons, path, header="OFF\n%d %d 0\n"):
    lines = [f"{x} {y} {z}" for x, y, z in vertices]
    lines += [" ".join(map(str, (len(p), *p))) for p in polygons]
    path.with_suffix(".off").write_text(header % (len(vertices), len(polygons)) + "\n".join(lines) + "\n")
    return path.with_suffix(".off")


def as_ply(vertices, polygons, path, kind="ascii"):
    header = (
        f"ply\r\nformat {kind} 1.0\r\ncomment made here\r\nelement vertex {len(vertices)}\r\n"
        "property float x\r\nproperty uchar red\r\nproperty float y\r\nproperty double z\r\n"
        f"element face {len(polygons)}\r\nproperty list uchar short vertex_index\r\n"
        "property list uchar float texcoord\r\nend_header\r\n"
    ).encode()
    if kind == "ascii":
        rows = [f"{x} 7 {y} {z}" for x, y, z in vertices]
        rows += [" ".join(map(str, (len(p), *p, 1, 0.5))) for p in polygons]
        body = "\r\n".join(rows).encode()
    else:
        order = "<" if "little" in kind else ">"
        body = b"".join(struct.pack(f"{order}fBfd", x, 7, y, z) for x, y, z in vertices)
        body += b"".join(struct.pack(f"{order}B{len(p)}hBf", len(p), *p, 1, 0.5) for p in polygons)
    path.with_suffix(".ply").write_bytes(header + body)
    return path.with_suffix(".ply")


@pytest.mark.parametrize("first", range(len(L_SHAPE)))
@pytest.mark.parametrize("write", [as_obj, as_off, as_ply])
def test_concave_polygons_are_solids_whichever_corner_is_first(first, write, tmp_path):
    path = write(*prism(first), tmp_path / "prism")
    report = check_mesh(path, scale=0.001)
    assert report.usable, report.problems
    assert report.volume_m3 == pytest.approx(1e-9 * 45 * (60 * 20 + 20 * 40))
    assert report.triangles == 2 * (len(L_SHAPE) - 2) + 2 * len(L_SHAPE)


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_ply_is_read_in_every_order_with_lists_of_any_length(kind, tmp_path):
    mesh = load_mesh(as_ply(*prism(0), tmp_path / "prism", kind), 0.001)
    assert mesh.volume == pytest.approx(1e-9 * 45 * (60 * 20 + 20 * 40))


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian"])
def test_ply_strips_of_triangles_are_read(kind, tmp_path):
    corners = [4, 0, 5, 1, 6, 2, 7, 3, 4, 0, -1, 1, 0, 2, 3, -1, 4, 5, 7, 6]
    points = [(x, y, z) for z in (0.0, 0.05) for x, y in ((0, 0), (0.04, 0), (0.04, 0.04), (0, 0.04))]
    header = (
        f"ply\nformat {kind} 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
        "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    ).encode()
    if kind == "ascii":
        rows = [" ".join(map(str, point)) for point in points] + [
            " ".join(map(str, (len(corners), *corners)))
        ]
        body = "\n".join(rows).encode()
    else:
        body = np.array(points, "<f4").tobytes() + np.array([len(corners), *corners], "<i4").tobytes()
    path = tmp_path / "strips.ply"
    path.write_bytes(header + body)
    report = check_mesh(path)
    assert report.usable, report.problems
    assert not any("inverted triangle" in repair for repair in report.repairs)
    assert (report.triangles, report.volume_m3) == (12, pytest.approx(0.04 * 0.04 * 0.05))


@pytest.mark.parametrize(
    "header", ["OFF%d %d 0\n", "OFF %d %d\n", "COFF\n%d %d 30\n", "# made here\nOFF\n\n%d %d 0\n"]
)
def test_off_headers_may_be_glued_or_apart(header, tmp_path):
    path = as_off(*prism(0), tmp_path / "prism", header)
    assert check_mesh(path, scale=0.001).usable


def test_obj_lines_may_go_on_after_a_backslash(tmp_path):
    path = as_obj(*prism(0), tmp_path / "prism")
    whole = load_mesh(path, 0.001)
    path.write_text(path.read_text().replace(" ", " \\\n  "))
    np.testing.assert_array_equal(load_mesh(path, 0.001).vertices, whole.vertices)
    path.write_text(path.read_text().replace("\n", "\r\n"))
    np.testing.assert_array_equal(load_mesh(path, 0.001).faces, whole.faces)


def test_vertices_that_no_triangle_uses_are_left_out(tmp_path):
    path = as_obj(*prism(0), tmp_path / "prism")
    path.write_text("v nan nan nan\nv 9e9 0 0\n" + path.read_text().replace("f ", "# f "))
    lines = ["f " + " ".join(str(k + 3) for k in polygon) for polygon in prism(0)[1]]
    path.write_text(path.read_text() + "\n" + "\n".join(lines))
    assert check_mesh(path, scale=0.001).extents_m == pytest.approx((0.06, 0.06, 0.045))


def test_the_blocks_of_a_long_file_meet(tmp_path, monkeypatch):
    monkeypatch.setattr("graspbench.geometry.text_formats._BLOCK", 37)
    path = as_obj(*prism(0), tmp_path / "prism")
    path.write_text(path.read_text().replace("f 1", "f \\\n1"))
    assert check_mesh(path, scale=0.001).usable
    path.write_text(path.read_text() + "\nv 1 2\n")
    with pytest.raises(MeshError, match=f"line {path.read_text().count(chr(10))} '1 2'"):
        load_mesh(path)
