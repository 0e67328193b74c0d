"""`graspbench report` says what its numbers leave out, pool and mix; folders are made by hand here."""

import os
import pty
import subprocess
import sys

import pytest

from graspbench.results.trial_result import ObjectResult, ProvenanceResult
from tests.report.made import write_trials


def notes(finished, table):
    return " ".join(finished.document["tables"][table]["notes"])


def rows(finished, table):
    return finished.document["tables"][table]["rows"]


def test_a_trial_that_was_not_executed_is_in_no_rate_test_or_correlation(cli, tmp_path):
    successes = [True, False, True, None, None, None]
    trials = [{"success": success} for success in successes]
    first = write_trials(tmp_path / "a", trials)
    grouped = cli("report", first, "--group", "object", "--json")
    assert grouped.code == 0, grouped.stderr
    (row,) = rows(grouped, "groups")
    assert row["success.rate"] == pytest.approx(2 / 3)
    assert row["success.trials"] == 3
    assert "Success is empty in 3 of 6 trials" in notes(grouped, "groups")
    second = write_trials(tmp_path / "b", [{"success": True}] * 6)
    compared = cli("report", "--compare", first, second, "--value", "success", "--json")
    (row,) = rows(compared, "compare")
    assert (row["pairs"], row["A.mean"], row["higher"]) == (3, pytest.approx(2 / 3), 1)
    assert "success 3 of 6" in notes(compared, "compare")


def test_what_a_table_pools_is_named_in_every_format(cli, tmp_path):
    trials = [
        {"seed": 0, "choice": {"surface": surface}, "settings": {"camera.width": width}}
        for surface in ("thesis", "smooth")
        for width in (320, 640)
    ]
    folder = write_trials(tmp_path / "a", trials)
    finished = cli("report", folder, "--format", "markdown,latex")
    assert "note: Pools trials that differ in choice.surface, camera.width." in finished.stdout
    assert "choice.surface, camera.width" in (folder / "report" / "table.md").read_text()
    assert "choice.surface, camera.width" in (folder / "report" / "table.tex").read_text()
    told = cli("report", folder, "--group", "surface,camera.width", "--json")
    assert len(rows(told, "groups")) == 4
    assert "Pools" not in notes(told, "groups")


def test_averaged_duplicates_are_counted(cli, tmp_path):
    twice = [{"seed": k // 2, "settings": {"camera.width": 320 * (1 + k % 2)}} for k in range(8)]
    first = write_trials(tmp_path / "a", twice)
    second = write_trials(tmp_path / "b", [{"seed": k, "settings": {"camera.width": 320}} for k in range(4)])
    finished = cli("report", "--compare", first, second, "--json")
    assert finished.code == 0, finished.stderr
    assert "Paired by camera.width, seed" in notes(finished, "compare")
    third = write_trials(tmp_path / "c", [{"seed": k} for k in range(4)])
    finished = cli("report", "--compare", first, third, "--json")
    assert "A: 8 of 8 trials, which differ in camera.width, are averaged to 4" in notes(finished, "compare")


def test_the_gain_column_holds_gains_only(cli, tmp_path):
    trials = [{}, {"index": {"name": "quality_ascent", "weight_q1": 1.0}}]
    folder = write_trials(tmp_path / "a", trials)
    finished = cli("report", folder, "--format", "markdown", "--json")
    assert {row["index"]: row["k_cm"] for row in rows(finished, "table")} == {
        "force_field": 1.0, "quality_ascent": None,
    }  # fmt: skip
    head, _, *lines = [x for x in (folder / "report/table.md").read_text().splitlines() if x.startswith("|")]
    assert head.startswith("| index | k\\_cm | object |")
    assert [line.split(" | ")[1] for line in lines] == ["1", "-"]


def test_results_of_several_versions_are_told(cli, tmp_path):
    trials = [
        {"provenance": ProvenanceResult(graspbench=version, git={"commit": commit * 40, "dirty": False})}
        for version, commit in (("0.1.0", "a"), ("0.2.0", "b"), ("0.2.0", "b"))
    ]
    folder = write_trials(tmp_path / "a", trials)
    finished = cli("report", folder, "--group", "object")
    sentence = "Mixes results of different code: versions 0.1.0, 0.2.0; commits aaaaaaaaaa, bbbbbbbbbb."
    assert finished.stdout.count(sentence) == 2
    one = write_trials(tmp_path / "b", trials[1:])
    assert "Mixes" not in cli("report", one).stdout


def test_an_unknown_statistic_is_one_sentence_whatever_else_is_asked(cli, tmp_path):
    folder = write_trials(tmp_path / "a", [{}])
    for more in ((), ("--group", "object"), ("--compare", folder)):
        finished = cli("report", folder, *more, "--stat", "mean,avrage")
        assert finished.code == 2
        assert finished.stderr.startswith("graspbench: unknown statistic 'avrage': ")
        assert not (folder / "report").exists()


def test_a_terminal_shows_tables_that_fit_it(tmp_path):
    folder = write_trials(tmp_path / "a", [{}, {}])
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "graspbench.cli", "report", str(folder), "--format", "csv"]
    environment = {"COLUMNS": "60", "TERM": "xterm", "PATH": "/usr/bin:/bin", "HOME": str(tmp_path)}
    done = subprocess.run(command, stdout=theirs, stderr=subprocess.PIPE, env=environment, check=False)
    os.close(theirs)
    text = os.read(ours, 1 << 16).decode()
    assert done.returncode == 0, done.stderr
    assert "┃" in text
    assert "|---" not in text
    assert "duck" in text


def test_a_trial_that_cannot_be_read_is_counted_once(cli, tmp_path):
    folder = write_trials(
        tmp_path / "a", [{}, {}, {"status": "failed", "reason": "no grasp", "success": False}]
    )
    (folder / "0000000001").mkdir()
    (folder / "0000000001" / "config.yaml").touch()
    (folder / "0000000001" / "result.json").write_text("{")
    finished = cli("report", folder, "--group", "object", "--json")
    assert finished.code == 0, finished.stderr
    for table in ("table", "groups"):
        assert "Of 4 trials 1 failed, 1 unreadable: not in the means." in notes(finished, table)
    assert [row["object.name"] for row in rows(finished, "groups")] == ["duck"]


def test_names_are_no_markup(cli, tmp_path):
    folder = write_trials(tmp_path / "a", [{"object": ObjectResult("[red]duck[/x]")}])
    output = tmp_path / "o[/x][red]"
    finished = cli("report", folder, "-o", output, "--format", "csv")
    assert finished.code == 0, finished.stderr
    assert f"written   {output}/table.csv" in finished.stdout
    assert "[red]duck[/x]" in finished.stdout
