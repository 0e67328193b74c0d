"""Mutated mesh files of every format: read, repaired or refused in one sentence, never a crash or a hang.

With GRASPBENCH_FUZZ=500 in the environment so many are tried instead of a few (pytest -s shows the slowest).
"""

import contextlib
import time

import numpy as np
import pytest
import trimesh

from graspbench.errors import MeshError
from graspbench.geometry import check_mesh, repair_mesh
from tests.fuzz import Budget
from tests.geometry.bad_meshes import ball, one_sentence, torus

BUDGET = Budget(60)
FILES = BUDGET.count
FORMATS = ("obj", "off", "stl", "stl_ascii", "ply", "ply_ascii", "glb")
NUMBERS = [b"0", b"-1", b"nan", b"inf", b"1e308", b"99999999999", b"\xc2\xb3", b"1_0", b"0x7", b"", b"-0.0"]


def written(body, kind):
    if kind == "ply_ascii":
        return trimesh.exchange.ply.export_ply(body, encoding="ascii")
    content = body.export(file_type=kind)
    return content.encode() if isinstance(content, str) else content


def mutated(content, rng):
    """Return a file with some bytes, words or lines of it changed, dropped, doubled, swapped or cut off."""
    broken = bytearray(content)
    for _ in range(rng.integers(1, 5)):
        at, to = sorted(rng.integers(0, len(broken) + 1, 2))
        match rng.integers(0, 8):
            case 0:
                broken[at : at + 1] = bytes([rng.integers(0, 256)])
            case 1:
                del broken[at : at + int(rng.integers(1, 40))]
            case 2:
                broken[at:at] = broken[at:to][:2000]
            case 3:
                del broken[max(at, 60) :]
            case 4:
                words = bytes(broken).split(b" ")
                words[rng.integers(len(words))] = NUMBERS[rng.integers(len(NUMBERS))]
                broken = bytearray(b" ".join(words))
            case 5:
                lines = bytes(broken).split(b"\n")
                i, j = rng.integers(len(lines), size=2)
                lines[i], lines[j] = lines[j], lines[i]
                broken = bytearray(b"\n".join(lines))
            case 6:
                broken[at : at + 4] = rng.choice([2**32 - 1, 2**31, 65535, 0]).astype("<u4").tobytes()
            case 7:
                broken[at : at + 8] = np.array([rng.choice([np.nan, np.inf, 1e300, -1e-300])]).tobytes()
        if not broken:
            break
    return bytes(broken)


@BUDGET.timeout
@pytest.mark.parametrize("kind", FORMATS)
def test_mutated_files_are_told_about_in_one_sentence(kind, tmp_path):
    rng = np.random.default_rng(FORMATS.index(kind))
    sources = [written(body, kind) for body in (ball(cells=3), torus())]
    slowest = 0.0
    for k in range(-(-FILES // len(FORMATS))):
        path = tmp_path / f"{k}.{kind.partition('_')[0]}"
        path.write_bytes(mutated(sources[k % 2], rng))
        start = time.process_time()
        report = check_mesh(path)
        assert report.usable or all(one_sentence(str(problem)) for problem in report.problems), path
        with contextlib.suppress(MeshError):
            fixed, after = repair_mesh(path)
            assert after.usable
            assert (after.bodies, after.watertight) == (1, True)
            assert fixed.volume > 0.0
        slowest = max(slowest, time.process_time() - start)
    print(f"{kind}: slowest {slowest:.2f} s")
    BUDGET.check_memory()
