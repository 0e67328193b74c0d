from dataclasses import replace

import numpy as np
import pytest

from graspbench.manipulation.case_study import CaseStudyParameters, run_case_study
from graspbench.report.case_study_figures import arm_lines, draw_case_study, write_histories


@pytest.fixture(scope="module")
def results():
    default = CaseStudyParameters(segment_s=0.5, pause_s=0.1)
    p = replace(default, clik=replace(default.clik, step_s=1e-2, integrator="heun"))
    return [run_case_study(True, p), run_case_study(False, p)]


def test_all_figures_and_animations_are_drawn(results, tmp_path):
    from PIL import Image

    files = draw_case_study(results, tmp_path / "figures", animation_frames=12)
    names = sorted(path.name for path in files)
    assert names == [
        "case_study_with_tasks.gif",
        "case_study_without_tasks.gif",
        "figure_4_4_path.png",
        "figure_4_5_pose_error.png",
        "figure_4_6_joint_3.png",
        "figure_4_7_contacts.png",
    ]
    for path in files:
        with Image.open(path) as image:
            assert image.width > 300
            assert (path.suffix == ".gif") == (getattr(image, "n_frames", 1) > 10)


def test_csv_holds_every_history(results, tmp_path):
    path = write_histories(results, tmp_path / "histories.csv")
    with path.open() as file:
        names = file.readline().strip().split(",")
    table = np.genfromtxt(path, delimiter=",", skip_header=1)
    times = results[0].history.times
    assert table.shape[1] == len(names) == len(set(names))
    written = table[:, names.index("time_s")]
    assert (written[0], written[-1]) == pytest.approx((times[0], times[-1]))
    assert np.diff(written)[:-1] == pytest.approx(max(0.02, times[1]), rel=1e-6)
    kept = np.searchsorted(times, written - 1e-9)
    np.testing.assert_allclose(table[:, names.index("with_tasks.q3_rad")], results[0].q3[kept], atol=1e-9)
    np.testing.assert_allclose(
        table[:, names.index("without_tasks.signed_distance_13_m")],
        results[1].signed_distance_13_m[kept],
        atol=1e-9,
    )


def test_links_are_one_metre_long_and_end_at_the_tips(results):
    for line in arm_lines(results[0], 20):
        np.testing.assert_allclose(np.linalg.norm(np.diff(line, axis=0), axis=1), 1.0, atol=1e-12)
