"""Meshes that nobody wants, made on the spot; and what a sentence is."""

import json
import struct

import manifold3d
import numpy as np
import trimesh

from graspbench.geometry.star_surface import cube_sphere


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


def glb(content):
    return glb_of(json.dumps(content).encode())


def glb_of(text):
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text


def one_sentence(text):
    return text.endswith(".") and "\n" not in text and "Traceback" not in text and 10 < len(text) < 260


BINARY_STL = b"x" * 80
ASCII_STL = trimesh.exchange.stl.export_stl_ascii(box()).encode()
