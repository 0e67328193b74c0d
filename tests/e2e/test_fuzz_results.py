"""Damaged results folders: each bad trial is one row, and nothing else is lost.

With GRASPBENCH_FUZZ=200 in the environment so many folders are tried instead of a few.
"""

import json
import shutil

import numpy as np
import pandas as pd
import pytest

from tests.e2e.test_streams_and_disks import QUICK
from tests.fuzz import Budget

BUDGET = Budget(4)
FOLDERS = BUDGET.count
TRIALS = 3
WORDS = [
    "null",
    "3",
    "-1",
    "1e999",
    '"x"',
    "[]",
    "{}",
    "[[[]]]",
    '"\\ud800"',
    '"</script>"',
    "NaN",
    '"=1"',
    "true",
]


@pytest.fixture(scope="module")
def whole(cli, tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole") / "r"
    finished = cli("sweep", *QUICK, f"seed=range(0,{TRIALS})", "record.pictures=true", "record.level=scores",
                   "--jobs", 0, "-o", folder)  # fmt: skip
    assert finished.code == 0, finished.stderr
    return folder


def damaged(content, rng):
    """Return a file with bytes changed, dropped or cut, or with a value of its JSON replaced."""
    broken = bytearray(content)
    at = int(rng.integers(0, len(broken)))
    match rng.integers(0, 7):
        case 0:
            broken[at] ^= 1 << int(rng.integers(0, 8))
        case 1:
            del broken[at:]
        case 2:
            del broken[at : at + int(rng.integers(1, 200))]
        case 3:
            broken[at : at + 4] = bytes(rng.integers(0, 256, 4, dtype=np.uint8))
        case 4:
            broken = bytearray(b"[" * 50_000)
        case _:
            pieces = bytes(broken).split(b": ")
            k = int(rng.integers(1, len(pieces))) if len(pieces) > 1 else 0
            rest = pieces[k].partition(b",")[2]
            pieces[k] = WORDS[rng.integers(len(WORDS))].encode() + (b"," + rest if rest else b"\n")
            broken = bytearray(b": ".join(pieces))
    return bytes(broken)


@BUDGET.timeout
def test_damaged_folders_are_reported_row_by_row(cli, whole, tmp_path):
    rng = np.random.default_rng(5)
    unreadable = 0
    for k in range(FOLDERS):
        folder = tmp_path / str(k)
        shutil.copytree(whole, folder)
        files = sorted(path for path in folder.rglob("*") if path.is_file() and path.stat().st_size)
        results = [path for path in files if path.name == "result.json"]
        chosen = {results[rng.integers(len(results))], files[rng.integers(len(files))]}
        for path in chosen:
            path.write_bytes(damaged(path.read_bytes(), rng))
        with BUDGET.case(f"folder {k}, damaged: {sorted(path.name for path in chosen)}"):
            unreadable += reported(cli, folder)
        shutil.rmtree(folder)
    print(f"{FOLDERS} folders, {unreadable} unreadable trials")
    assert unreadable
    BUDGET.check()


def reported(cli, folder):
    """Return how many trials of a folder are unreadable, as a report and a sweep find."""
    finished = cli("report", folder, "--format", "csv,markdown,html", "--group", "object", "--json")
    assert finished.code == 0, finished.stderr
    assert "Traceback" not in finished.stderr
    assert json.loads(finished.stdout)["tables"]
    again = cli("sweep", *QUICK, f"seed=range(0,{TRIALS})", "record.pictures=true", "record.level=scores",
                "--dry-run", "--json", "-o", folder)  # fmt: skip
    assert again.code == 0, again.stderr
    states = [row["state"] for row in json.loads(again.stdout)]
    assert len(states) == TRIALS
    assert states.count("done") >= TRIALS - 2
    return states.count("unreadable")


def test_an_unreadable_trial_is_run_again_on_request(cli, whole, tmp_path):
    folder = tmp_path / "r"
    shutil.copytree(whole, folder)
    bad = sorted(folder.glob("*/result.json"))[1]
    bad.write_text("{")
    command = ("sweep", *QUICK, f"seed=range(0,{TRIALS})", "record.pictures=true", "record.level=scores",
               "--jobs", 0, "-o", folder)  # fmt: skip
    assert cli(*command).code == 1
    assert sorted(pd.read_csv(folder / "trials.csv")["status"]) == ["done", "done", "unreadable"]
    assert cli(*command, "--retry-failed").code == 0
    assert pd.read_csv(folder / "trials.csv")["status"].tolist() == ["done"] * TRIALS
