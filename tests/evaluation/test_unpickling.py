import io
import os
import pickle

import numpy as np
import pytest

from graspbench.evaluation.formats.error import GraspFileError
from graspbench.evaluation.formats.unpickling import load_npy


class Malicious:
    def __init__(self, target):
        self.target = target

    def __reduce__(self):
        return os.system, (f"touch {self.target}",)


def npy_of(pickled: bytes) -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": "|O", "fortran_order": False, "shape": ()})
    return buffer.getvalue() + pickled


def test_code_in_a_pickle_is_refused_and_not_executed(tmp_path):
    file, touched = tmp_path / "bad.npy", tmp_path / "touched"
    np.save(file, np.array({"grasp_qpos": Malicious(touched)}, dtype=object), allow_pickle=True)
    with pytest.raises(GraspFileError, match=r"holds code .*system.*nothing of it was executed"):
        load_npy(file)
    assert not touched.exists()


@pytest.mark.parametrize(
    "program",
    [
        b"cbuiltins\neval\n(S'1'\ntR.",
        b"cnumpy\nndarray\n(I100000000000\ntR.",
        b"cnumpy.testing\nrundocs\n.",
        b"cnumpy._core.multiarray\n_reconstruct\n(cnumpy\ndtype\n(I0\ntS'b'\ntR.",
        b"cos\nsystem\n(S'true'\ntR.",
        b"Pwhatever\n.",
        b"\x80\x04",
        b"",
    ],
)
def test_other_programs_are_refused(program, tmp_path):
    (tmp_path / "bad.npy").write_bytes(npy_of(program))
    with pytest.raises(GraspFileError):
        load_npy(tmp_path / "bad.npy")


def typed(state, code="V8"):
    """A pickle of an array of one item whose type has some state that NumPy itself would obey."""

    class Kind:
        def __reduce__(self):
            return np.dtype, (code, False, True), state

    class Array:
        def __reduce__(self):
            made = np._core.multiarray._reconstruct
            return made, (np.ndarray, (0,), b"b"), (1, (1,), Kind(), False, b"\x10" * 8)

    return pickle.dumps(Array(), protocol=2)


POINTERS = {"a": (np.dtype("O"), 0)}  # bytes taken for pointers to objects


@pytest.mark.parametrize(
    ("state", "code"),
    [
        ((3, "|", None, ("a",), POINTERS, 8, 1, 0), "V8"),
        ((3, "|", (np.dtype("O"), (1,)), None, None, 8, 1, 0), "V8"),
        ((3, "<", None, None, None, 1 << 40, 1, 0), "f8"),
        ((3, "<", None, None, None, 1, 1, 0), "f8"),
        ((3, "?", None, None, None, -1, -1, 0), "f8"),
        ((3, "<"), "f8"),
        ("state", "f8"),
        ((4, "<", None, None, None, -1, -1, 0, {"a": 1}), "M8"),
        ((3, "<", None, None, None, -1, -1, 0), "U999999999"),
        ((3, "<", None, None, None, -1, -1, 0), "f4"),
        ((3, "|", None, None, None, -1, -1, 63), "O"),
    ],
)
def test_types_of_arrays_that_are_broken_on_purpose_are_refused(state, code, tmp_path):
    (tmp_path / "bad.npy").write_bytes(npy_of(typed(state, code)))
    with pytest.raises(GraspFileError, match=r"no readable NumPy file|does not hold"):
        load_npy(tmp_path / "bad.npy")


def changed(*replaced):
    """A pickle of plain data with some of its bytes replaced."""
    whole = pickle.dumps(np.array({"rows": np.arange(3.0)}, dtype=object), protocol=2)
    for before, after in replaced:
        assert before in whole
        whole = whole.replace(before, after)
    return whole


@pytest.mark.parametrize(
    "program",
    [
        changed((b"K\x03\x85", b"J\xff\xff\xff\x7f\x85")),  # two thousand million rows
        changed((b"K\x03\x85", b"J\xff\xff\xff\xff\x85")),  # less than none
        b"\x80\x02K\x01r\xff\xff\xff\x7f.",  # a place in memory far beyond the file
        b"cnumpy._core.multiarray\n_reconstruct\n(N}S'__defaults__'\nN(I1\nI2\nttsb.",  # a changed maker
        b"cnumpy._core.numeric\n_frombuffer\n(L1000000000000L\ncnumpy\ndtype\n(S'f8'\ntR(I1\ntS'C'\ntR.",
        b"cnumpy._core.multiarray\nscalar\n(cnumpy\ndtype\n(S'O'\ntRS'12345678'\ntR.",
    ],
)
def test_arrays_that_are_broken_on_purpose_are_refused(program, tmp_path):
    (tmp_path / "bad.npy").write_bytes(npy_of(program))
    with pytest.raises(GraspFileError, match="no readable NumPy file"):
        load_npy(tmp_path / "bad.npy")


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
def test_plain_data_is_read_as_numpy_reads_it(protocol, tmp_path):
    content = {
        "rows": np.arange(12.0).reshape(3, 4),
        "fortran": np.asfortranarray(np.arange(6).reshape(2, 3)),
        "single": np.float32(1.5),
        "bigendian": np.arange(3, dtype=">i4"),
        "texts": np.array(["joint", "äb"]),
        "bytes": np.array([b"a", b"bc"]),
        "truth": np.array([True, False]),
        "text": "äb",
        "list": [1, (2.0, None, True)],
        "objects": np.array([{"a": 1}, "b"], dtype=object),
    }
    array = np.empty((), dtype=object)
    array[()] = content
    (tmp_path / "good.npy").write_bytes(npy_of(pickle.dumps(array, protocol=protocol)))
    found = load_npy(tmp_path / "good.npy")
    np.testing.assert_array_equal(found["rows"], content["rows"])
    np.testing.assert_array_equal(found["fortran"], content["fortran"])
    for name in ("bigendian", "texts", "bytes", "truth"):
        np.testing.assert_array_equal(found[name], content[name])
        assert found[name].dtype.newbyteorder("=") == content[name].dtype.newbyteorder("=")
    assert found["objects"].tolist() == content["objects"].tolist()
    assert (found["single"], found["text"], found["list"]) == (1.5, "äb", [1, (2.0, None, True)])


def test_plain_arrays_and_damaged_files(tmp_path):
    np.save(tmp_path / "plain.npy", np.eye(3))
    np.testing.assert_array_equal(load_npy(tmp_path / "plain.npy"), np.eye(3))
    whole = (tmp_path / "plain.npy").read_bytes()
    for cut in (0, 4, 20, len(whole) - 8):
        (tmp_path / "cut.npy").write_bytes(whole[:cut])
        with pytest.raises(GraspFileError, match="no readable NumPy file"):
            load_npy(tmp_path / "cut.npy")
