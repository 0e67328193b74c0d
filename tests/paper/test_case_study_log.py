from dataclasses import replace

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from graspbench.manipulation.case_study import CaseStudyParameters, run_case_study
from graspbench.paper.case_study_log import record_case_study
from graspbench.record import log_info


def test_log_holds_the_grippers_and_the_bar_by_time(tmp_path):
    p = CaseStudyParameters(segment_s=0.5, pause_s=0.1)
    result = run_case_study(True, replace(p, clik=replace(p.clik, integrator="euler", step_s=2e-3)))
    path = record_case_study(result, tmp_path / "log.mcap")
    info = log_info(path)
    assert info.complete
    frames = len(result.history.times[::20])
    assert {info.messages[topic] for topic in ("/joints", "/hand", "/tf")} == {frames}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        decoded = [
            (c.topic, m.log_time, d) for _, c, m, d in reader.iter_decoded_messages(["/hand", "/joints"])
        ]
    hands = [message for topic, _, message in decoded if topic == "/hand"]
    joints = [message for topic, _, message in decoded if topic == "/joints"]
    assert len(joints[0].joints) == 14
    assert [j.position for j in joints[-1].joints] == result.history.joints[20 * (frames - 1)].tolist()
    first = hands[0].entities[0].lines
    # four branches of five links, each 1 m long, from the bases to the tips
    assert len(first) == 4
    for line in first:
        points = np.array([(q.x, q.y, q.z) for q in line.points])
        np.testing.assert_allclose(np.linalg.norm(np.diff(points, axis=0), axis=1), 1.0, atol=1e-6)
    start = [first[k].points[0] for k in (0, 2)]
    np.testing.assert_allclose([(q.x, q.y) for q in start], p.bases_m, atol=1e-6)
