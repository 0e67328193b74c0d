"""Damaged logs: all that is readable is saved, and what is lost is said.

With GRASPBENCH_FUZZ=500 in the environment so many damaged files are tried instead of a few.
"""

import os
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from graspbench.errors import LogError
from graspbench.record import log_info, recover_log
from tests.fuzz import Budget
from tests.record.test_mcap_log import write

BUDGET = Budget(60)
FILES = BUDGET.count


def damaged(content, rng):
    """Return a file with bits flipped, bytes overwritten, dropped or doubled, or its end cut off."""
    broken = bytearray(content)
    for _ in range(rng.integers(1, 4)):
        at = int(rng.integers(8, len(broken)))
        match rng.integers(0, 6):
            case 0 | 1:
                broken[at] ^= 1 << int(rng.integers(0, 8))
            case 2:
                broken[at : at + 8] = rng.integers(0, 256, 8, dtype=np.uint8).tobytes()
            case 3:
                del broken[at : at + int(rng.integers(1, 2000))]
            case 4:
                broken[at:at] = broken[at : at + int(rng.integers(1, 2000))]
            case 5 if len(broken) > 2000:
                del broken[max(at, 1000) :]
    return bytes(broken)


@pytest.fixture
def whole(tmp_path, trial):
    return write(tmp_path / "trial.mcap", trial)


def heads(content, opcode):
    """Return where the records of a kind begin in the data section, and how long they are."""
    at, found = 8, []
    while at < len(content) - 8 and content[at] != 0x0F:
        length = int.from_bytes(content[at + 1 : at + 9], "little")
        if content[at] == opcode:
            found.append((at, length))
        at += 9 + length
    return found


def test_each_damaged_chunk_loses_its_own_messages_and_no_other(whole, tmp_path):
    content, before = whole.read_bytes(), log_info(whole)
    chunks = heads(content, 0x06)
    assert len(chunks) > 3
    for k, (at, length) in enumerate(chunks):
        broken = bytearray(content)
        broken[at + 9 + length // 2] ^= 4
        path = tmp_path / f"{k}.mcap"
        path.write_bytes(broken)
        saved = recover_log(path)
        assert saved.complete
        (lost,) = saved.lost
        assert lost.startswith("damaged chunks: 1, with the messages /")
        missing = sum(int(word) for word in lost.replace(",", " ").split() if word.isdigit()) - 1
        assert saved.message_count == before.message_count - missing
        assert all(before.schemas[topic] == name for topic, name in saved.schemas.items())
        assert saved.attachments == before.attachments


def test_the_schema_of_a_damaged_chunk_is_found_elsewhere(tmp_path, whole):
    content = whole.read_bytes()
    end = sum(heads(content, 0x06)[-1]) + 9  # no summary that repeats the schemas
    for k, (at, length) in enumerate(heads(content[:end], 0x06)[:-1]):
        broken = bytearray(content[:end])
        broken[at + 9 + length // 2] ^= 4
        path = tmp_path / f"{k}.mcap.partial"
        path.write_bytes(broken)
        saved = recover_log(path)
        with saved.path.open("rb") as stream:
            for schema, channel, _message in make_reader(stream).iter_messages():
                assert schema is not None, channel.topic


def test_a_broken_length_costs_one_record(tmp_path, whole):
    content, before = whole.read_bytes(), log_info(whole)
    at, _ = heads(content, 0x06)[2]
    for value in (2**63, 5, 2**20):
        broken = bytearray(content)
        broken[at + 1 : at + 9] = value.to_bytes(8, "little")
        path = tmp_path / f"{value}.mcap"
        path.write_bytes(broken)
        saved = recover_log(path)
        assert 0 < before.message_count - saved.message_count < 0.5 * before.message_count
        assert saved.lost


@BUDGET.timeout
def test_damaged_files_are_told_about_in_one_sentence(whole, tmp_path):
    content, before = whole.read_bytes(), log_info(whole)
    rng = np.random.default_rng(20)
    refused = 0
    for k in range(FILES):
        path = tmp_path / f"{k}.mcap.partial"
        path.write_bytes(damaged(content, rng))
        found = log_info(path)
        if found.message_count == 0:
            with pytest.raises(LogError, match=r"^[^\n]*no readable message[^\n]*$"):
                recover_log(path)
            refused += 1
            continue
        saved = recover_log(path)
        assert saved.complete
        assert saved.message_count == found.message_count
        assert saved.lost or found.complete or path.stat().st_size < len(content)
        assert set(saved.messages) <= set(before.messages)
        saved.path.unlink()
    assert refused < 0.2 * FILES
    BUDGET.check_memory()


def test_what_is_no_regular_file_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe.mcap")
    for path in (tmp_path / "pipe.mcap", tmp_path, Path("/dev/zero")):
        with pytest.raises(LogError, match="no regular file"):
            log_info(path)
