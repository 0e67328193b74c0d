"""The search over parameters, with a broken study, odd folders and a measure that is none."""

import pytest

from tests.sweep.test_tune import SMALL

TUNE = ("tune", "index.k_e=interval(0.5,2)", *SMALL, "-n", 1, "--jobs", 0)


def test_a_column_without_numbers_is_no_measure(cli, tmp_path):
    finished = cli(*TUNE, "-m", "object.name", "-o", tmp_path / "r")
    assert finished.code == 2
    assert "the column 'object.name' holds 'teddy', no numbers" in finished.stderr


@pytest.mark.parametrize("name", ["what?", "%41", "a b", "a#b", "ü&=;"])
def test_a_folder_may_be_called_anything(cli, tmp_path, name):
    finished = cli(*TUNE, "-m", "local.q1", "-o", tmp_path / name)
    assert finished.code == 0, finished.stderr
    assert (tmp_path / name / "study.db").is_file()
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("content", [b"", b"no database", b"SQLite format 3\0" + bytes(4000)])
def test_a_broken_study_is_named_and_costs_no_trial(cli, tmp_path, content):
    (tmp_path / "study.db").write_bytes(content)
    finished = cli(*TUNE, "-m", "local.q1", "-o", tmp_path)
    if not content:
        assert finished.code == 0, finished.stderr
        whole = bytearray((tmp_path / "study.db").read_bytes())
        whole[4096:12288] = bytes(range(256)) * 32
        (tmp_path / "study.db").write_bytes(whole)
        finished = cli(*TUNE, "-m", "local.q1", "-o", tmp_path)
    assert finished.code == 2
    assert (
        finished.stderr.strip().splitlines()[-1].startswith(f"graspbench: the study {tmp_path / 'study.db'}")
    )
    assert "Traceback" not in finished.stderr
