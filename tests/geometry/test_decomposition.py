import numpy as np
import trimesh

from graspbench.geometry import decomposition
from graspbench.geometry.convex_union import to_manifold
from graspbench.geometry.decomposition import convex_parts


def l_shape():
    tall = to_manifold(*arrays(trimesh.creation.box((0.02, 0.05, 0.1))))
    wide = to_manifold(*arrays(trimesh.creation.box((0.08, 0.05, 0.02)))).translate((0.03, 0.0, -0.04))
    mesh = (tall + wide).to_mesh64()
    return trimesh.Trimesh(np.asarray(mesh.vert_properties), np.asarray(mesh.tri_verts), process=False)


def arrays(mesh):
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def test_a_convex_body_is_its_own_part():
    box = trimesh.creation.box((0.03, 0.04, 0.05))
    (part,) = convex_parts(box)
    assert len(part.vertices) == 8


def test_an_l_is_cut_into_few_parts_that_are_exactly_it():
    mesh = l_shape()
    parts = convex_parts(mesh)
    assert 2 <= len(parts) <= 4
    total = sum(part.volume for part in parts)
    assert mesh.volume * (1 - 1e-6) <= total <= 1.011 * mesh.volume


def test_the_cache_is_used_and_survives_a_broken_file(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    first = convex_parts(l_shape())
    (file,) = tmp_path.rglob("*.npz")
    monkeypatch.setattr(decomposition, "_hulls", None)  # would fail if it were called
    cached = convex_parts(l_shape())
    for a, b in zip(first, cached, strict=True):
        np.testing.assert_array_equal(a.vertices, b.vertices)
    monkeypatch.undo()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    file.write_bytes(file.read_bytes()[:100])
    assert len(convex_parts(l_shape())) == len(first)
    assert len(list(tmp_path.rglob("*.npz"))) == 1


def test_a_cache_that_cannot_be_written_is_no_error(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(blocked))
    assert len(convex_parts(l_shape())) >= 2


def test_the_hole_of_a_ring_and_the_cavity_of_a_cup_stay_open():
    ring = trimesh.creation.torus(0.04, 0.008, major_sections=48, minor_sections=24)
    assert deepest(ring, [(0.02 * np.cos(a), 0.02 * np.sin(a), 0.0) for a in range(7)]) < 0.0
    outside = to_manifold(*arrays(trimesh.creation.cylinder(0.03, 0.08)))
    within = to_manifold(*arrays(trimesh.creation.cylinder(0.027, 0.08))).translate((0.0, 0.0, 0.004))
    cup = outside - within
    mesh = cup.to_mesh64()
    body = trimesh.Trimesh(np.asarray(mesh.vert_properties), np.asarray(mesh.tri_verts), process=False)
    inside = [(0.02 * np.cos(a), 0.02 * np.sin(a), z) for a in range(7) for z in (-0.025, 0.0, 0.03)]
    assert deepest(body, inside) < 0.0
    assert deepest(body, [(0.0285, 0.0, 0.0), (0.0, -0.0285, 0.02), (0.0, 0.0, -0.038)]) >= 0.0


def deepest(mesh, points):
    """Return how far the deepest of the points is inside the parts of a mesh, m; negative outside."""
    depths = []
    for part in convex_parts(mesh):
        offsets = np.einsum("ij,ij->i", part.face_normals, part.triangles[:, 0])
        depths.append(np.min(offsets[:, None] - part.face_normals @ np.transpose(points), axis=0))
    return np.max(depths)
