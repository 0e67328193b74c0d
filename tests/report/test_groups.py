"""Tables of one's own grouping, and correlations, in their formats."""

import shutil
import subprocess

import numpy as np
import pandas as pd
import pytest

from graspbench.errors import ConfigurationError
from graspbench.report.groups import correlation_table, frame_latex, frame_markdown, group_table, heading
from graspbench.report.statistics import wilson_interval


@pytest.fixture
def trials():
    generator = np.random.default_rng(3)
    quality = generator.uniform(0, 1, 60)
    return pd.DataFrame(
        {
            "trial_id": [f"{k:010x}" for k in range(60)],
            "object.name": ["duck", "teddy_1"] * 30,
            "index.k_cm": [0.0, 0.0, 1.0, 1.0] * 15,
            "success": quality > 0.2,
            "local.q1": quality,
            "local.time_s": 0.1 + 0.01 * np.arange(60),
            "execution.phases.lift.slip_m": 0.01 * (1 - quality),
        }
    )


def test_groups_hold_means_and_wilsons_rates(trials):
    table = group_table(trials, ["object", "k_cm"], ["mean", "count"], ["q1"])
    assert list(table.columns[:3]) == ["object.name", "index.k_cm", "trials"]
    assert len(table) == 4
    first = trials[(trials["object.name"] == "duck") & (trials["index.k_cm"] == 0)]
    assert table.loc[0, "local.q1.mean"] == pytest.approx(first["local.q1"].mean())
    rate = wilson_interval(int(first["success"].sum()), len(first))
    assert tuple(table.loc[0, ["success.rate", "success.low", "success.high"]]) == pytest.approx(
        (rate.value, rate.low, rate.high)
    )


def test_a_trial_without_success_has_failed(trials):
    trials["success"] = trials["success"].astype(object).where(trials["local.q1"] > 0.5, None)
    table = group_table(trials, ["object"], ["mean"], ["local.q1"])
    rate = (trials["local.q1"] > 0.5).groupby(trials["object.name"]).mean()
    assert table["success.rate"].tolist() == pytest.approx(rate.tolist())


def test_column_that_is_not_there_is_refused_with_near_ones(trials):
    with pytest.raises(ConfigurationError, match=r"no column 'local\.q7': choose from local\.q1"):
        group_table(trials, ["object"], ["mean"], ["local.q7"])


def test_correlation_finds_the_order(trials):
    table = correlation_table(trials).set_index("outcome")
    slip = table.loc["execution.phases.lift.slip_m"]
    assert slip["rho"] == pytest.approx(-1.0)
    assert slip["low"] <= slip["rho"] <= slip["high"]
    assert table.loc["success", "rho"] > 0.5


@pytest.mark.parametrize(
    ("column", "expected"),
    [
        ("local.time_s.mean", "local.time.mean [s]"),
        ("reconstruction.mesh_mean_mm", "reconstruction.mesh_mean [mm]"),
        ("local.q1.mean", "local.q1.mean"),
        ("seed", "seed"),
    ],
)
def test_headings_carry_units(column, expected):
    assert heading(column) == expected


def test_best_mean_is_bold_smallest_for_times(trials):
    table = group_table(trials, ["object"], ["mean"], ["local.q1", "local.time_s"])
    rows = frame_markdown(table, "t").splitlines()[4:6]
    best = int(table["local.time_s.mean"].argmin())
    assert rows[best].count("**") >= 2
    assert f"**{table['local.time_s.mean'].min():.3g}**" in rows[best]


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="no LaTeX here")
def test_latex_compiles_with_booktabs_alone(trials, tmp_path):
    table = group_table(trials, ["object", "k_cm"], ["mean", "ci"], ["local.q1", "local.time_s"])
    (tmp_path / "a.tex").write_text(frame_latex(table, "By 50 % & more", "tab:a"))
    (tmp_path / "b.tex").write_text(frame_latex(correlation_table(trials), "Rank_correlation", "tab:b"))
    (tmp_path / "paper.tex").write_text(
        "\\documentclass{article}\\usepackage{booktabs}\\begin{document}\\input{a}\\input{b}\\end{document}\n"
    )
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "paper.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
