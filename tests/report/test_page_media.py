"""Pictures of a folder that came from somebody: neither their number nor their size is unbounded."""

import struct
import zlib

import cv2
import numpy as np
import pytest

from graspbench.report import page_media
from graspbench.report.page_media import MAX_MEDIA, trial_media


def _png(path, width=8, height=6):
    cv2.imwrite(str(path), np.random.default_rng(width).integers(0, 255, (height, width, 3), np.uint8))


def _announced(path, width, height):
    """Write a small file that announces a picture of any size."""
    head = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    body = struct.pack(">I", 13) + head + struct.pack(">I", zlib.crc32(head))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + body)


@pytest.mark.parametrize("mode", ["embed", "link"])
def test_so_many_pictures_of_a_trial_are_shown(tmp_path, mode):
    for k in range(3 * MAX_MEDIA):
        _png(tmp_path / f"{k:03d}.png")
    shown = trial_media([None, tmp_path], tmp_path, mode)
    assert list(shown) == ["1"]
    assert [name for _, name, _ in shown["1"]] == [f"{k:03d}" for k in range(MAX_MEDIA)]


@pytest.mark.parametrize("mode", ["embed", "link"])
def test_what_is_no_picture_of_a_size_to_be_shown_is_left_out(tmp_path, mode):
    _announced(tmp_path / "bomb.png", 60_000, 60_000)
    _announced(tmp_path / "flat.png", 2**31 - 1, 0)
    (tmp_path / "bomb.gif").write_bytes(b"GIF89a" + struct.pack("<HH", 65_535, 65_535) + bytes(50))
    (tmp_path / "script.gif").write_bytes(b"<svg onload=alert(1)>" * 3)
    _png(tmp_path / "text.png")
    (tmp_path / "text.png").write_bytes(b"text" + (tmp_path / "text.png").read_bytes())
    with (tmp_path / "long.png").open("wb") as stream:
        stream.write((tmp_path / "text.png").read_bytes()[4:])
        stream.truncate(1 << 40)
    _png(tmp_path / "good.png")
    assert [name for _, name, _ in trial_media([tmp_path], tmp_path, mode)["0"]] == ["good"]


def test_a_page_carries_so_much_and_links_to_the_rest(tmp_path, monkeypatch):
    folders = [tmp_path / str(k) for k in range(6)]
    for folder in folders:
        folder.mkdir()
        _png(folder / "grasp.png", 200, 200)
    whole = [media[0][2] for media in trial_media(folders, tmp_path, "embed").values()]
    assert all(address.startswith("data:") for address in whole)
    monkeypatch.setattr(page_media, "_MAX_CARRIED_BYTES", 3 * len(whole[0]) + 10)
    addresses = [media[0][2] for media in trial_media(folders, tmp_path, "embed").values()]
    assert addresses == [*whole[:3], *(f"./{k}/grasp.png" for k in range(3, 6))]


def test_a_wide_picture_is_carried_smaller(tmp_path):
    _png(tmp_path / "wide.png", 4000, 1)
    (_, _, address) = trial_media([tmp_path], tmp_path, "embed")["0"][0]
    assert address.startswith("data:image/jpeg;base64,")
