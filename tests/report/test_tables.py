"""The table of local against global grasps in its three formats."""

import shutil
import subprocess

import numpy as np
import pandas as pd
import pytest

from graspbench.errors import ConfigurationError, LogError
from graspbench.report import comparison_table, write_table
from graspbench.report.tables import latex_escape


def frame(**changes):
    rows = []
    for k_cm in (0, 1):
        for name, fingers, scale in (("bottle", 4, 1.0), ("teddy", 3, 0.9), ("my_mug & 50% #1", 3, 0.8)):
            for seed in (0, 1):
                row = {
                    "status": "done", "object.name": name, "hand.name": "radial", "hand.fingers": fingers,
                    "index.name": "force_field", "index.k_cm": k_cm, "seed": seed,
                }  # fmt: skip
                for i, best in enumerate((0.4, 0.012, 0.3), start=1):
                    ratio = scale - 0.01 * i - 0.02 * k_cm + 0.004 * seed
                    row |= {f"local.q{i}": best * ratio, f"global.q{i}.value": best, f"ratio.q{i}": ratio}
                rows.append(row)
    return pd.DataFrame(rows).assign(**changes)


def test_rows_are_in_the_order_of_the_thesis():
    rows = comparison_table(frame())
    assert [(row.k_cm, row.object) for row in rows] == [
        (k, name) for k in (1.0, 0.0) for name in ("bottle", "my_mug & 50% #1", "teddy")
    ]


def test_trials_of_other_seeds_are_averaged():
    row = comparison_table(frame())[0]
    assert row.trials == 2
    assert row.cells[0].ratio == pytest.approx(1.0 - 0.01 - 0.02 + 0.002)
    assert row.cells[1].best == pytest.approx(0.012)


def test_thesis_ratios_stand_beside_its_own_objects_only():
    rows = {(row.k_cm, row.object): row for row in comparison_table(frame())}
    assert rows[1.0, "teddy"].cells[1].thesis == pytest.approx(0.536 / 0.690)
    assert rows[0.0, "bottle"].cells[2].thesis == pytest.approx(0.574 / 0.590)
    assert np.isnan(rows[0.0, "my_mug & 50% #1"].cells[0].thesis)
    other = comparison_table(frame(**{"index.name": "mirtich_canny"}))
    assert all(np.isnan(cell.thesis) for row in other for cell in row.cells)


def test_failed_trials_are_counted_but_not_averaged():
    trials = frame()
    trials.loc[trials["seed"] == 1, "status"] = "failed"
    trials.loc[trials["seed"] == 1, "ratio.q1"] = np.nan
    row = comparison_table(trials)[0]
    assert (row.trials, row.failed) == (1, 1)
    assert row.cells[0].ratio == pytest.approx(0.97)


def test_trials_without_global_search_have_empty_cells(tmp_path):
    trials = frame().drop(columns=[c for c in frame() if c.startswith(("global", "ratio"))])
    (path,) = write_table(trials, ["markdown"], tmp_path)
    assert "/ - | - |" in path.read_text()


def test_other_indices_have_no_gain(tmp_path):
    trials = frame(**{"index.name": "quality_ascent"}).drop(columns="index.k_cm")
    rows = comparison_table(trials)
    assert {row.k_cm for row in rows} == {None}
    write_table(trials, ["csv", "markdown", "latex"], tmp_path)


def test_csv_keeps_types_and_full_precision(tmp_path):
    (path,) = write_table(frame(), ["csv"], tmp_path)
    table = pd.read_csv(path)
    assert table["k_cm"].tolist() == [1, 1, 1, 0, 0, 0]
    assert table["q1_ratio"][0] == pytest.approx(0.972, abs=1e-12)
    assert table["object"][1] == "my_mug & 50% #1"
    assert np.isnan(table["q1_ratio_thesis"][1])


def test_markdown_is_one_rectangular_table(tmp_path):
    (path,) = write_table(frame(), ["markdown"], tmp_path)
    lines = [line for line in path.read_text().splitlines() if line.startswith("|")]
    assert len(lines) == 8
    assert len({line.count("|") - line.count("\\|") for line in lines}) == 1
    assert r"my\_mug" in path.read_text()


def test_best_ratio_of_a_measure_is_bold(tmp_path):
    markdown, latex = write_table(frame(), ["markdown", "latex"], tmp_path)
    # Bottle with k_cm = 0 leads in all three.
    assert markdown.read_text().count("**") == 2 * 3
    assert r"\textbf{0.99}" in latex.read_text()
    assert latex.read_text().count(r"\textbf") == 3


def test_latex_escapes_every_special_character():
    assert latex_escape(r"a_b & 5% #1 ~^ {x}\y $") == (
        r"a\_b \& 5\% \#1 \textasciitilde{}\textasciicircum{} \{x\}\textbackslash{}y \$"
    )


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="no LaTeX here")
@pytest.mark.parametrize("thesis", [True, False])
def test_latex_compiles_with_booktabs_alone(tmp_path, thesis):
    trials = frame() if thesis else frame(**{"index.name": "a_b<c"})
    trials["object.name"] = trials["object.name"].replace("my_mug & 50% #1", "mug_5%&#1")
    write_table(trials, ["latex"], tmp_path)
    (tmp_path / "paper.tex").write_text(
        "\\documentclass{article}\\usepackage{booktabs}\\begin{document}\\input{table}\\end{document}\n"
    )
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "paper.tex"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-2000:]
    assert "Overfull" not in done.stdout


def test_unknown_format_and_no_trials_are_refused_before_anything_is_written(tmp_path):
    with pytest.raises(ConfigurationError, match="unknown table format 'xls'"):
        write_table(frame(), ["csv", "xls"], tmp_path / "report")
    with pytest.raises(LogError, match="the trials are none"):
        write_table(frame().iloc[:0], ["csv"], tmp_path / "report")
    with pytest.raises(LogError, match=r"lack the column object\.name"):
        write_table(pd.DataFrame({"status": ["done"]}), ["csv"], tmp_path / "report")
    assert not (tmp_path / "report").exists()
