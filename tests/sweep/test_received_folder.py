"""A sweep that goes on in a folder that came from somebody: its links and pipes lead nowhere."""

import json
import os
import pickle

import pytest

from graspbench.config.engine import MAX_JOBS_PER_CORE, load_engine
from graspbench.errors import ConfigurationError, LogError, OutputError
from graspbench.experiment.export import file_name
from graspbench.results.store import ResultStore, read_result
from graspbench.sweep.slurm_engine import JOBS_FOLDER, Chunk, _executor
from graspbench.sweep.tune import STUDY_FILE, _readable_study
from graspbench.sweep.worker import Limits, _last_words
from graspbench.trial.runner import fault_file

TRIAL = "00000000ab"


@pytest.fixture(params=["link", "pipe", "folder"])
def place(request, tmp_path):
    """Make something odd where a file is to be written; what it leads to must stay as it is."""
    victim = tmp_path / "victim"
    victim.write_text("kept")

    def make(path):
        if request.param == "link":
            path.symlink_to(victim)
        elif request.param == "pipe":
            os.mkfifo(path)
        else:
            path.mkdir()

    yield make
    assert victim.read_text() == "kept"


def test_a_claim_is_made_in_a_file_of_the_folder_alone(place, tmp_path):
    store = ResultStore(tmp_path / "r")
    store.root.mkdir()
    place(store.root / ".claims")
    with pytest.raises(OutputError, match=r"^nothing can be written to [^\n]*$"), store.claim(TRIAL):
        pass


def test_a_study_is_kept_in_a_file_of_the_folder_alone(place, tmp_path):
    place(tmp_path / STUDY_FILE)
    with (
        pytest.raises(OutputError, match=r"^nothing can be written to [^\n]*$"),
        _readable_study(tmp_path / STUDY_FILE),
    ):
        pass


@pytest.mark.parametrize("kind", ["link", "pipe"])
def test_last_words_go_into_a_file_of_their_own(kind, tmp_path):
    path, victim = fault_file(tmp_path, TRIAL), tmp_path / "victim"
    victim.write_text("kept")
    path.symlink_to(victim) if kind == "link" else os.mkfifo(path)
    with _last_words(path, None):
        assert path.is_file()
        assert not path.is_symlink()
    assert victim.read_text() == "kept"
    assert not path.exists()


@pytest.mark.parametrize("kind", ["link", "pipe", "folder", "values"])
def test_a_result_is_read_from_a_file_of_the_folder_alone(kind, tmp_path):
    path, victim = tmp_path / "result.json", tmp_path / "victim.json"
    victim.write_text('{"schema": 3}')
    if kind == "link":
        path.symlink_to(victim)
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        path.write_text(json.dumps({"schema": 3, "times_s": {f"x{i}": i for i in range(30_000)}}))
    with pytest.raises(LogError, match="more than 20000 values" if kind == "values" else "no regular file"):
        read_result(path)


class _Program:
    """What a pickle may be: something that is done when it is read."""

    def __init__(self, command):
        self.command = command

    def __reduce__(self):
        return os.system, (self.command,)


def test_no_pickle_of_a_received_folder_is_read_or_written(tmp_path):
    root, marker = tmp_path / "r", tmp_path / "done"
    trap = pickle.dumps(_Program(f"touch {marker}"))
    traps = []
    for number in range(os.getpid(), os.getpid() + 400):  # of the jobs to come
        folder = root / JOBS_FOLDER / str(number)
        folder.mkdir(parents=True)
        traps += [folder / f"{number}_submitted.pkl", folder / f"{number}_0_result.pkl"]
    for path in traps:
        path.write_bytes(trap)
    executor = _executor(root, load_engine(["engine=slurm", "engine.cluster=local"]))
    job = executor.submit(Chunk((), root, Limits()))
    assert job.result() == 0  # trials were run
    assert not marker.exists()
    assert all(path.read_bytes() == trap for path in traps)


def test_jobs_are_kept_in_a_folder_of_the_folder_alone(tmp_path):
    (tmp_path / "r").mkdir()
    (tmp_path / JOBS_FOLDER).mkdir()
    (tmp_path / "r" / JOBS_FOLDER).symlink_to(tmp_path / JOBS_FOLDER)
    with pytest.raises(OutputError, match=r"^nothing can be written to [^\n]*it is a link[^\n]*$"):
        _executor(tmp_path / "r", load_engine(["engine=slurm", "engine.cluster=local"]))
    assert not list((tmp_path / JOBS_FOLDER).iterdir())


def test_an_exported_file_stays_in_its_folder():
    assert file_name("../../etc/passwd_0") == "______etc_passwd_0"
    assert file_name("radial_sphère_3") == "radial_sphère_3"
    assert len(file_name("x" * 5000)) <= 100


def test_a_machine_takes_only_so_many_trials_at_a_time():
    most = MAX_JOBS_PER_CORE * len(os.sched_getaffinity(0))
    assert load_engine(jobs=most).jobs == most
    with pytest.raises(ConfigurationError, match=f"give at most {most}"):
        load_engine(jobs=most + 1)
    assert load_engine(["engine=slurm"], jobs=most + 1).jobs == most + 1
    with pytest.raises(ConfigurationError, match=r"engine\.jobs"):
        load_engine(["engine=slurm", "engine.jobs=100000000"])
