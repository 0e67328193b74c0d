"""What results and caches say of the machine and its user, and what of others' text they let work."""

import json
import os
import stat
from pathlib import Path

import pandas as pd
import pytest

from graspbench import cache
from graspbench.config.engine import load_engine
from graspbench.errors import ConfigurationError
from graspbench.hand.files import write_urdf
from graspbench.results.traces import without_places
from tests.e2e.test_streams_and_disks import QUICK


def test_the_machine_is_named_on_request_alone(cli, tmp_path):
    for wanted in (False, True):
        finished = cli("run", *QUICK, f"record.host={str(wanted).lower()}", "--json", "-o", tmp_path / "r")
        assert finished.code == 0, finished.stderr
        assert (finished.document["provenance"]["host"] is not None) == wanted


def test_no_path_of_the_machine_is_in_a_failed_trial(cli, tmp_path, monkeypatch):
    monkeypatch.setattr("graspbench.trial.pipeline.run_grasp", _fails)
    finished = cli("sweep", *QUICK, "--jobs", 0, "-o", tmp_path / "r")
    assert finished.code == 1
    (error,) = (tmp_path / "r").glob("*/error.txt")
    text = error.read_text()
    assert "runner.py" in text
    written = text + error.with_name("result.json").read_text() + (tmp_path / "r" / "trials.csv").read_text()
    places = {str(Path(__file__).parents[2]), str(Path.home()), os.uname().nodename}
    assert not [place for place in places if len(place) > 2 and place in written]


def _fails(*_):
    raise RuntimeError(f"in {Path.home()}/secret/file")


def test_no_path_of_the_machine_is_in_the_page(cli, tmp_path):
    assert cli("run", *QUICK, "-o", tmp_path / "r").code == 0
    assert cli("report", tmp_path / "r", "--format", "html,markdown,latex").code == 0
    for path in (tmp_path / "r" / "report").iterdir():
        assert str(tmp_path) not in path.read_text()


def test_a_formula_in_the_table_is_text(cli, tmp_path):
    finished = cli("run", *QUICK, "object.name='=cmd|x'", "object.mesh=missing.stl", "-o", tmp_path / "r")
    assert finished.code == 2
    name = "object.name='=1+1'"
    finished = cli("sweep", *QUICK, name, "object.mesh=missing.stl", "--jobs", 0, "-o", tmp_path / "r")
    assert finished.code == 1
    table = pd.read_csv(tmp_path / "r" / "trials.csv")
    assert table["object.name"].tolist() == ["'=1+1"]
    (result,) = (tmp_path / "r").glob("*/result.json")
    assert json.loads(result.read_text())["object"]["name"] == "=1+1"


@pytest.mark.parametrize("partition", ["a\nrm -rf x", "a b", "$(x)", "a;b", ""])
def test_a_partition_is_one_word(partition):
    with pytest.raises(ConfigurationError):
        load_engine(["engine=slurm", f"engine.partition='{partition}'"])
    assert load_engine(["engine=slurm", "engine.partition=gpu-1_long"]).partition == "gpu-1_long"


def test_places_are_told_from_what_stands_in_them():
    text = without_places(f'File "{cache.__file__}", line 3; {Path.home()}/x')
    assert 'File "graspbench/cache.py", line 3' in text
    assert "~/x" in text


@pytest.fixture
def fresh_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    cache.user_cache.cache_clear()
    yield tmp_path / "cache"
    cache.user_cache.cache_clear()


def test_hands_are_cached_where_only_their_user_writes(fresh_cache):
    path = write_urdf("<robot/>", "mine")
    assert path.parent == fresh_cache / "graspbench" / "hands"
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    assert write_urdf("<robot/>", "mine") == path


@pytest.mark.parametrize("odd", ["open to all", "link", "file"])
def test_a_cache_that_is_not_the_user_s_own_is_left_alone(fresh_cache, odd):
    folder = fresh_cache / "graspbench" / "hands"
    folder.parent.mkdir(parents=True)
    if odd == "open to all":
        folder.mkdir()
        folder.chmod(0o777)
    elif odd == "link":
        (fresh_cache / "theirs").mkdir()
        folder.symlink_to(fresh_cache / "theirs")
    else:
        folder.write_text("")
    path = write_urdf("<robot/>", "mine")
    assert fresh_cache not in path.parents
    assert stat.S_IMODE(path.parent.stat().st_mode) == 0o700
    assert path.read_text() == "<robot/>"
