"""The trial's log: what is in it, that it is reproducible, and what is left when it is cut."""

import json
import os
import signal
import subprocess
import sys
import textwrap
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from graspbench.errors import LogError
from graspbench.record import CHANNELS, RecordParameters, TrialLog, log_info, recover_log


def write(path, trial, record="full"):
    with TrialLog(path, record) as log:
        log.metadata("trial", {"seed": 3})
        log.attach("config.yaml", "seed: 3\n")
        log.message("begins")
        log.object_pose(np.eye(4))
        log.views(trial.views, trial.silhouettes)
        for surface in trial.surfaces:
            log.surface(surface)
        log.grasp(trial.grasp)
        log.joints(
            ["a", "b"], np.array([0.0, 0.1]), np.array([[0.0, 1.0], [0.5, 1.5]]), np.stack([np.eye(4)] * 2)
        )
        log.scores({"local.q1": 0.25, "global.q1": np.nan, "done": True})
    return path


def decoded(path, topic):
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        return [(m.log_time, d) for _, _, m, d in reader.iter_decoded_messages(topics=[topic])]


def test_full_log_has_every_kind_of_message(tmp_path, trial):
    info = log_info(write(tmp_path / "trial.mcap", trial))
    assert info.complete
    assert set(info.messages) == set(CHANNELS) - {"/paths", "/hand"}
    assert info.messages["/camera/image"] == info.messages["/camera/silhouette"] == 3
    assert info.schemas["/surface/mesh"] == "foxglove.SceneUpdate"
    assert info.attachments == {"config.yaml": "seed: 3\n"}
    assert info.metadata["trial"] == {"seed": "3"}


def test_images_and_boxes_read_back(tmp_path, trial):
    path = write(tmp_path / "trial.mcap", trial, RecordParameters(image_format="png"))
    image = decoded(path, "/camera/image")[0][1]
    pixels = cv2.imdecode(np.frombuffer(image.data, np.uint8), cv2.IMREAD_COLOR)[..., ::-1]
    np.testing.assert_array_equal(pixels, trial.views[0].image)
    outline, box = decoded(path, "/camera/annotations")[0][1].points
    corners = np.array([(p.x, p.y) for p in box.points])
    np.testing.assert_allclose((corners.min(axis=0), corners.max(axis=0)), [(19.5, 9.5), (44.5, 29.5)])
    around = np.array([(p.x, p.y) for p in outline.points])
    np.testing.assert_allclose((around.min(axis=0), around.max(axis=0)), [(20, 10), (44, 29)])


def test_surface_snapshots_keep_the_first_and_the_last(tmp_path, trial):
    path = write(tmp_path / "trial.mcap", trial, RecordParameters(surface_every=3))
    meshes = [d.entities[0].triangles[0] for _, d in decoded(path, "/surface/mesh")]
    radii = [max(p.x for p in mesh.points) for mesh in meshes]
    kept = [trial.surfaces[k].points[:, 0].max() for k in (0, 3, 4)]
    np.testing.assert_allclose(radii, kept, rtol=1e-6)


def test_last_snapshot_is_kept_even_if_the_surface_never_came_to_rest(tmp_path, trial):
    with TrialLog(tmp_path / "trial.mcap", RecordParameters(surface_every=10)) as log:
        for surface in trial.surfaces[:4]:
            log.surface(surface)
    meshes = [d.entities[0].triangles[0] for _, d in decoded(tmp_path / "trial.mcap", "/surface/mesh")]
    assert max(p.x for p in meshes[-1].points) == pytest.approx(trial.surfaces[3].points[:, 0].max())


def test_motion_lasts_as_long_as_planned(tmp_path, trial):
    path = write(tmp_path / "trial.mcap", trial)
    (first, _), (last, states) = decoded(path, "/joints")
    assert last - first == 100_000_000
    assert [(s.name, s.position) for s in states.joints] == [("a", 0.5), ("b", 1.5)]


def test_scores_are_json_without_nan(tmp_path, trial):
    path = write(tmp_path / "trial.mcap", trial)
    with path.open("rb") as stream:
        (data,) = [m.data for _, _, m in make_reader(stream).iter_messages(topics=["/scores"])]
    assert json.loads(data) == {"local.q1": 0.25, "global.q1": None, "done": True}


def test_time_stamps_never_go_back(tmp_path, trial):
    path = write(tmp_path / "trial.mcap", trial)
    with path.open("rb") as stream:
        times = [m.log_time for _, _, m in make_reader(stream).iter_messages(log_time_order=False)]
    assert times == sorted(times)


def test_same_trial_gives_the_same_bytes(tmp_path, trial):
    assert write(tmp_path / "a.mcap", trial).read_bytes() == write(tmp_path / "b.mcap", trial).read_bytes()


def test_level_scores_keeps_sentences_and_scores_only(tmp_path, trial):
    info = log_info(write(tmp_path / "trial.mcap", trial, "scores"))
    assert set(info.messages) == {"/log", "/scores"}
    assert "config.yaml" in info.attachments


def test_level_off_writes_nothing(tmp_path, trial):
    write(tmp_path / "trial.mcap", trial, "off")
    assert list(tmp_path.iterdir()) == []


def test_exception_leaves_a_partial_log_that_can_be_recovered(tmp_path, trial):
    path = tmp_path / "trial.mcap"

    def fail():
        with TrialLog(path) as log:
            log.surface(trial.surfaces[0])
            raise RuntimeError("the hand fell off")

    with pytest.raises(RuntimeError):
        fail()
    assert not path.exists()
    partial = tmp_path / "trial.mcap.partial"
    assert not log_info(partial).complete

    info = recover_log(partial)

    assert info.path == path
    assert info.complete
    assert decoded(path, "/log")[-1][1].message == "the hand fell off"
    assert info.messages["/surface/mesh"] == 1


def test_killed_process_loses_nothing_that_was_logged(tmp_path):
    code = """
        import os, signal, sys
        from pathlib import Path
        from graspbench.record import TrialLog
        with TrialLog(Path(sys.argv[1])) as log:
            log.attach("config.yaml", "x")
            for k in range(50):
                log.scores({"k": k})
                log.message(f"step {k}")
            os.kill(os.getpid(), signal.SIGKILL)
    """
    path = tmp_path / "trial.mcap"
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code), str(path)], env=os.environ, check=False
    )
    assert done.returncode == -signal.SIGKILL

    info = recover_log(tmp_path / "trial.mcap.partial")

    assert info.messages == {"/scores": 50, "/log": 50}
    assert info.attachments == {"config.yaml": "x"}


def test_cut_anywhere_still_reads(tmp_path, trial):
    whole = write(tmp_path / "trial.mcap", trial).read_bytes()
    counts = []
    for k, size in enumerate(np.linspace(9, len(whole) - 1, 25).astype(int)):
        cut = tmp_path / f"{k}.mcap"
        cut.write_bytes(whole[:size])
        info = log_info(cut)
        assert not info.complete
        counts.append(info.message_count)
    assert counts == sorted(counts)
    assert counts[-1] == log_info(tmp_path / "trial.mcap").message_count


def test_damaged_chunk_is_skipped_and_counted(tmp_path, trial):
    path = write(tmp_path / "trial.mcap", trial)
    data = bytearray(path.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 8] = bytes(8)
    path.write_bytes(data)
    info = log_info(path)
    assert not info.complete
    recovered = recover_log(path)
    assert recovered.path == tmp_path / "trial.recovered.mcap"
    assert 0 < recovered.message_count == info.message_count


def test_recovery_never_overwrites(tmp_path, trial):
    path = write(tmp_path / "trial.mcap", trial)
    before = path.read_bytes()
    with pytest.raises(LogError, match="exists already"):
        recover_log(path, path)
    assert path.read_bytes() == before


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04" * 10])
def test_other_files_are_refused_in_one_sentence(tmp_path, content):
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(LogError, match="is no MCAP file"):
        log_info(path)
    with pytest.raises(LogError, match="is no MCAP file"):
        recover_log(path)
    assert list(tmp_path.iterdir()) == [path]


def test_missing_file_is_named(tmp_path):
    with pytest.raises(LogError, match=r"cannot read log .*none\.mcap"):
        log_info(tmp_path / "none.mcap")


def test_log_without_messages_cannot_be_recovered(tmp_path):
    path = tmp_path / "x.mcap.partial"
    path.write_bytes(b"\x89MCAP0\r\n")
    with pytest.raises(LogError, match="no readable message"):
        recover_log(path)
    assert list(tmp_path.iterdir()) == [path]


def test_executed_motion_carries_the_object(tmp_path):
    poses = np.stack([np.eye(4)] * 3)
    poses[:, 2, 3] = [0.0, 0.1, 0.2]
    motion = SimpleNamespace(
        times_s=np.array([0.0, 0.02, 0.04]), joints=np.zeros((3, 1)),
        transform_palm_to_world=np.stack([np.eye(4)] * 3), transform_object_to_world=poses,
    )  # fmt: skip
    with TrialLog(tmp_path / "trial.mcap") as log:
        log.motion(["a"], motion)
    frames = [
        {t.child_frame_id: t.translation.z for t in d.transforms}
        for _, d in decoded(tmp_path / "trial.mcap", "/tf")
    ]
    assert frames == [{"palm": 0.0, "object": z} for z in (0.0, 0.1, 0.2)]


def test_paths_are_logged_in_their_colours(tmp_path):
    line = np.linspace([0, 0, 0.1], [0, 0, 0.0], 5)
    path = SimpleNamespace(via=line[:2], approach=line[:3], grasp=line[2:])
    with TrialLog(tmp_path / "trial.mcap") as log:
        log.paths([path])
    ((_, scene),) = decoded(tmp_path / "trial.mcap", "/paths")
    (entity,) = scene.entities
    assert len(entity.spheres) == 2
    assert [len(line.points) for line in entity.lines] == [3, 3]
    assert entity.lines[0].color.g > entity.lines[0].color.r
    assert entity.lines[1].color.r > entity.lines[1].color.g
