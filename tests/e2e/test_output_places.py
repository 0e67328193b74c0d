"""Where results go: places that cannot be written, and folders that are the user's own."""

import pytest

from tests.small import SMALL_PICTURES

QUICK = ("experiment=quick", "object=sphere", "surface.meridians=12", "surface.parallels=11", *SMALL_PICTURES)


@pytest.fixture
def places(tmp_path):
    (tmp_path / "a_file").write_text("mine")
    return {
        "a file": tmp_path / "a_file",
        "below a file": tmp_path / "a_file" / "deep",
        "nobody's": "/proc/nope",
        "a name too long": tmp_path / ("n" * 300),
    }


@pytest.mark.parametrize("place", ["a file", "below a file", "nobody's", "a name too long"])
@pytest.mark.parametrize("command", ["run", "sweep"])
def test_a_place_that_cannot_be_written_is_one_sentence(cli, places, command, place):
    jobs = ("--jobs", 0) if command == "sweep" else ()
    finished = cli(command, *QUICK, *jobs, "-o", places[place])
    assert finished.code == 2, finished.stderr
    last = finished.stderr.strip().splitlines()[-1]
    assert last.startswith("graspbench: ")
    assert str(places[place])[:40] in last
    assert "Traceback" not in finished.stderr


def test_a_report_that_cannot_be_written_is_one_sentence(cli, tmp_path):
    assert cli("run", *QUICK, "-o", tmp_path / "r").code == 0
    finished = cli("report", tmp_path / "r", "--output", "/proc/nope")
    assert finished.code == 2
    assert "/proc/nope" in finished.stderr
    assert "Traceback" not in finished.stderr


def test_a_failed_run_removes_only_what_it_made(cli, tmp_path):
    empty = tmp_path / "p" / "out"
    empty.mkdir(parents=True)
    bad = ("run", "object.mesh=missing.stl")
    assert cli(*bad, "-o", empty).code == 2
    assert empty.is_dir()
    assert cli(*bad, "-o", empty / "new" / "deep").code == 2
    assert list(empty.iterdir()) == []
    assert cli(*bad, "-o", ".", cwd=empty).code == 2
    assert empty.is_dir()
