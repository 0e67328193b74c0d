"""An attacker's results folder through the real commands: nothing of it works, nothing outside is read."""

import json
import re
import shutil

import pytest

from tests.e2e.test_streams_and_disks import QUICK
from tests.report import browser

TEXTS = (
    "</script><script>window.hacked=1</script>", "{{geometry}}{% raw %}",
    "<img src=x onerror=window.hacked=1>", "=cmd|'/c calc'!A1", "\\input{/etc/passwd}\\write18{id}",
    "../../../secret", "[link](javascript:window.hacked=1)",
)  # fmt: skip


@pytest.fixture(scope="module")
def attack(cli, tmp_path_factory):
    """Trials whose id, names and reason are the attacker's, with links that lead outside."""
    root = tmp_path_factory.mktemp("attack")
    finished = cli("run", *QUICK, "record.level=scores", "record.pictures=false", "-o", root / "one")
    assert finished.code == 0, finished.stderr
    (honest,) = (root / "one").glob("*/result.json")
    (root / "secret").mkdir()
    (root / "secret" / "result.json").write_text('{"secret": "word"}')
    (root / "secret" / "grasp.png").write_text("secretword")
    for k, text in enumerate(TEXTS):
        folder = root / "r" / f"{k:010x}"
        shutil.copytree(honest.parent, folder)
        result = json.loads(honest.read_text())
        result |= {"trial_id": text, "reason": text, "status": "done", "overridden": [text, "object.name"]}
        result["object"]["name"] = result["hand"]["name"] = result["index"]["name"] = text
        result["config"]["object"]["name"] = text
        result["config"][text] = text
        result["choice"][text] = text
        (folder / "result.json").write_text(json.dumps(result))
        (folder / "grasp.png").symlink_to(root / "secret" / "grasp.png")
    finished = cli("report", root / "r", "--group", "object.name", "-o", root / "out")
    assert finished.code == 0, finished.stderr
    return root / "out"


def test_no_written_file_holds_what_works(attack):
    texts = {path.name: path.read_text() for path in attack.iterdir() if path.suffix != ".parquet"}
    assert {".csv", ".md", ".tex", ".html"} <= {"." + name.rpartition(".")[2] for name in texts}
    for name, text in texts.items():
        assert "secretword" not in text
        if name.endswith(".html"):
            assert "<script>window.hacked" not in text
            assert "<img src=x" not in text
        if name.endswith(".md"):
            assert not re.search(r"(?<!\\)[<\]]", text)
        if name.endswith(".tex"):
            assert "\\input{" not in text
            assert "\\write18" not in text
        if name.endswith(".csv"):
            assert not [
                cell for line in text.splitlines() for cell in line.split(",") if cell.startswith("=")
            ]


@pytest.mark.skipif(not browser.AVAILABLE, reason=browser.REASON)
def test_nothing_runs_in_a_browser(attack, tmp_path):
    with browser.browser(tmp_path / "browser") as window:
        window.open(attack / "index.html")
        rows = "document.querySelectorAll('#trials tbody tr')"
        assert window.run(f"return {rows}.length") == len(TEXTS)
        for k in range(len(TEXTS)):
            window.run(f"{rows}[{k}].click(); document.getElementById('close').click()")
        waited = "return new Promise(done => setTimeout(() => done(window.hacked ?? null), 300))"
        assert window.run(waited) is None
        assert window.console() == []
        images = "return [...document.images].map(i => i.src).filter(s => !s.startsWith('data:'))"
        assert window.run(images) == []
