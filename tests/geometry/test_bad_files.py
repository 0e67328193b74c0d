"""Files that are no mesh, or a broken one: each is refused with one clear sentence."""

import json
import os
import struct
import tracemalloc

import pytest

from graspbench.errors import MeshError
from graspbench.geometry import check_mesh, load_mesh
from tests.geometry.bad_meshes import (
    ASCII_STL,
    BINARY_STL,
    ball,
    glb,
    glb_of,
    one_sentence,
)

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
    "corner zero.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "broken", "face 1 has a corner"),
    "plane.obj": (b"v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n", "broken", "'0 0' is no point"),
    "cut off text.stl": (ASCII_STL[: len(ASCII_STL) // 2], "broken", "cut off before endsolid"),
    "comma.stl": (ASCII_STL.replace(b".", b","), "broken", "is no point"),
    "cut off.off": (b"OFF\n3 1 0\n0 0 0\n1 0 0\n", "broken", "cut off before its 3 vertices"),
    "page.stl": (b"<!DOCTYPE html><html>404</html>", "broken", "web page"),
    "pointer.obj": (b"version https://git-lfs.github.com/spec/v1\n", "broken", "Git LFS"),
    "archive.ply": (b"PK\x03\x04" + bytes(99), "broken", "zip archive"),
    "words.off": (b"OFF\n3 1 0\na b c\n", "broken", "cannot be read"),
    "wrong.glb": (b"glTF\x02\x00\x00\x00\xff\xff\xff\x7f" + bytes(40), "broken", "cannot be read"),
    "superscript.off": ("OFF\n\u00b3 \u00b2 0\n0 0 0\n".encode(), "broken", "numbers of its vertices"),
    "endless.off": (b"OFF\n99999999999999999999999 2 0\n", "too_large", "announces an array"),
    "binary.off": (b"OFF BINARY\n", "broken", "as text"),
    "too few.off": (b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4 0 1 2\n", "broken", "is no face"),
    "one line.obj": (b"v 0 0 0 " * 700_000, "broken", "more than 1000000 characters"),
    "huge numbers.obj": (
        b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999\n",
        "broken",
        "has a corner that does not exist",
    ),
    "no properties.ply": (
        b"ply\nformat ascii 1.0\nelement thing 9000000\nelement vertex 1\nproperty float x\nend_header\n1\n",
        "broken",
        "",
    ),
    "negative list.ply": (
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
        b"element face 1\nproperty list char int vertex_indices\nend_header\n0 0 0\n-3 0 0 0\n",
        "broken",
        "",
    ),
    "zeros.glb": (glb({"accessors": [{"count": 8_999_990, "type": "VEC3"}] * 9}), "too_large", "MB in all"),
    "one mesh often.glb": (
        glb(
            {
                "accessors": [{"count": 1_000_000, "type": "VEC3"}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}] * 50}],
            }
        ),
        "too_large",
        "announces an array of 50000000",
    ),
    "loop.glb": (
        glb({"scenes": [{"nodes": [0]}], "nodes": [{"children": [1]}, {"children": [0]}]}),
        "broken",
        "two parents",
    ),
    "elsewhere.glb": (
        glb({"buffers": [{"byteLength": 9, "uri": "../secret.bin"}]}),
        "broken",
        "no plain file beside it",
    ),
    "memory.glb": (glb({"buffers": [{"byteLength": 9, "uri": "/proc/self/mem"}]}), "broken", "no plain file"),
    "deep.glb": (glb_of(b'{"nodes":' + b"[" * 100_000), "broken", "cut off or broken"),
    "drawing.step": (b"ISO-10303-21;", "format", "no mesh format"),
}


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


def test_missing_files_and_folders(tmp_path):
    with pytest.raises(MeshError, match="no mesh file"):
        load_mesh(tmp_path / "none.stl")
    with pytest.raises(MeshError, match="is not a file"):
        load_mesh(tmp_path)


@pytest.mark.parametrize("uri", ["pipe.bin", "link.bin", "pi%70e.bin"])
def test_a_buffer_that_is_no_plain_file_is_never_opened(uri, tmp_path):
    os.mkfifo(tmp_path / "pipe.bin")
    (tmp_path / "link.bin").symlink_to("/proc/self/mem")
    path = tmp_path / "mesh.glb"
    path.write_bytes(glb({"buffers": [{"byteLength": 9, "uri": uri}]}))
    with pytest.raises(MeshError, match="no plain file beside it"):
        load_mesh(path)


def test_a_buffer_beside_the_mesh_is_read(tmp_path):
    ball(cells=2).export(tmp_path / "whole.glb")
    whole = (tmp_path / "whole.glb").read_bytes()
    length = struct.unpack_from("<I", whole, 12)[0]
    content = json.loads(whole[20 : 20 + length])
    (tmp_path / "points.bin").write_bytes(whole[28 + length :])
    content["buffers"][0]["uri"] = "points.bin"
    (tmp_path / "apart.glb").write_bytes(glb(content))
    assert load_mesh(tmp_path / "apart.glb").volume == pytest.approx(ball(cells=2).volume, rel=1e-5)


@pytest.mark.parametrize(
    "make", [lambda path: os.mkfifo(path), lambda path: path.symlink_to("/proc/self/mem")]
)
def test_what_is_no_plain_file_is_refused_at_once(make, tmp_path):
    make(tmp_path / "mesh.obj")
    with pytest.raises(MeshError) as caught:
        load_mesh(tmp_path / "mesh.obj")
    assert one_sentence(str(caught.value))


def test_what_a_bomb_announces_is_not_allocated(tmp_path):
    accessors = [{"componentType": 5126, "count": 8_999_990, "type": "VEC3"}] * 60
    primitives = [{"attributes": {"POSITION": k}, "mode": 4} for k in range(60)]
    path = tmp_path / "bomb.glb"
    path.write_bytes(
        glb({"asset": {"version": "2.0"}, "accessors": accessors, "meshes": [{"primitives": primitives}]})
    )
    tracemalloc.start()
    assert not check_mesh(path).usable
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 10e6
