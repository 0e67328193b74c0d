import os

import pytest

from graspbench.quiet import captured_output


def test_what_a_library_prints_is_kept_and_goes_nowhere(capfd):
    os.write(1, b"before\n")
    with captured_output() as captured:
        os.write(1, b"b3Warning: no inertia\n")
        os.write(2, b"b3Error: no mesh\n")
    print("after")
    assert "b3Warning" in captured.text
    assert "b3Error" in captured.text
    printed = capfd.readouterr()
    assert printed.out == "before\nafter\n"
    assert printed.err == ""


def test_descriptors_come_back_after_an_error(capfd):
    with pytest.raises(ValueError, match="inside"), captured_output():
        raise ValueError("inside")
    os.write(1, b"still there\n")
    assert capfd.readouterr().out == "still there\n"
