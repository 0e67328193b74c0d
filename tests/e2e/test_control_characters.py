"""No terminal obeys what somebody else wrote."""

import io
import json

import pytest
from rich.text import Text

from graspbench.cli.printing import PlainConsole, print_json, print_rows

ATTACKS = ("\x1b[2J", "\x1b]0;title\x07", "\x9b31m", "a\rb", "\u202egnp.exe", "\x08\x7f")


@pytest.mark.parametrize("text", ATTACKS)
def test_control_characters_are_shown_and_not_sent(text, capsys):
    print_rows([{"name": text, "value": 1}], title=text)
    print_json({"name": text, text: 1})
    stream = io.StringIO()
    console = PlainConsole(file=stream, markup=False, width=80)
    console.print(text)
    console.print(Text.assemble((text, "red"), " and\ttabs\nand lines"))
    printed = capsys.readouterr().out
    assert not [c for c in printed + stream.getvalue() if not c.isprintable() and c not in "\n\t"]
    assert "and lines" in stream.getvalue()
    assert json.loads(printed[printed.index("{\n") :]) == {"name": text, text: 1}


def test_colours_of_our_own_are_sent_to_a_terminal():
    stream = io.StringIO()
    console = PlainConsole(file=stream, force_terminal=True, color_system="standard", markup=False)
    console.print(Text.assemble(("failed", "red"), ": \x1b[2J"))
    assert "\x1b[31mfailed\x1b[0m: \\x1b[2J" in stream.getvalue()


@pytest.mark.parametrize(
    "words",
    [
        ("sweep", "--timeout", "1e300"), ("sweep", "--memory", "inf"), ("sweep", "--timeout", "nan"),
        ("tune", "--seed", "99999999999"), ("tune", "--failed", "nan"), ("tune", "-n", "1000000000"),
        ("sweep", "seed=range(0,1e9)"), ("sweep", "seed=range(0,10,0)"), ("sweep", "seed=range(0,inf)"),
        ("sweep", "index.k_e=interval(0,1)"), ("sweep", "seed=" + "9" * 5000), ("config", "seed=" + "[" * 99),
        ("sweep", "seed=range(0,200)", "object=range(0,200)"), ("sweep", "--jobs", "100000"),
    ],
)  # fmt: skip
def test_what_would_never_end_is_refused(cli, tmp_path, words):
    finished = cli(*words, cwd=tmp_path)
    assert finished.code == 2
    assert "Traceback" not in finished.stderr
    assert list(tmp_path.iterdir()) == []
