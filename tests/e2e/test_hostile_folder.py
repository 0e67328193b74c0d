"""An attacker's results folder through the real commands: nothing of it works, nothing outside is read."""

import json
import re
import shutil
from urllib.parse import unquote, urlsplit

import cv2
import numpy as np
import pytest

from tests.e2e.test_streams_and_disks import QUICK
from tests.report import browser

TEXTS = (
    "</script><script>window.hacked=1</script>", "{{geometry}}{% raw %}",
    "<img src=x onerror=window.hacked=1>", "=cmd|'/c calc'!A1", "\\input{/etc/passwd}\\write18{id}",
    "../../../secret", "[link](javascript:window.hacked=1)",
)  # fmt: skip
PICTURES = (
    "grasp.png", "..%2f..%2fsecret%2fgrasp.png", "..\\..\\secret\\grasp.png",
    "javascript:window.hacked=1.png", '"><img src=x onerror=window.hacked=1>.png', "?a=1#b.png",
)  # fmt: skip


@pytest.fixture(scope="module")
def attack(cli, tmp_path_factory):
    """Trials whose id, names and reason are the attacker's, with links that lead outside."""
    root = tmp_path_factory.mktemp("attack")
    finished = cli("run", *QUICK, "record.level=scores", "record.pictures=false", "-o", root / "one")
    assert finished.code == 0, finished.stderr
    (honest,) = (root / "one").glob("*/result.json")
    (root / "secret").mkdir()
    (root / "secret" / "grasp.png").write_text("secretword")
    outside = json.loads(honest.read_text()) | {"reason": "secretword"}
    (root / "secret" / "result.json").write_text(json.dumps(outside))
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
        (folder / "hand.png").symlink_to(root / "secret" / "grasp.png")
        for name in PICTURES:
            cv2.imencode(".png", np.full((8, 8), 99, dtype=np.uint8))[1].tofile(folder / name)
    (linked := root / "r" / "00000000ff").mkdir()
    (linked / "config.yaml").symlink_to(root / "secret" / "result.json")
    (linked / "result.json").symlink_to(root / "secret" / "result.json")
    (root / "r" / "00000000fe").symlink_to(root / "one")
    for pictures in ("embed", "link"):
        arguments = ("--group", "object.name", "--pictures", pictures, "-o", root / pictures)
        finished = cli("report", root / "r", *arguments)
        assert finished.code == 0, finished.stderr
        assert "secretword" not in finished.stdout
    return root


def test_no_written_file_holds_what_works(attack):
    texts = {
        path.name: path.read_text() for path in (attack / "embed").iterdir() if path.suffix != ".parquet"
    }
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
@pytest.mark.parametrize("pictures", ["embed", "link"])
def test_nothing_runs_in_a_browser(attack, tmp_path, pictures):
    with browser.browser(tmp_path / "browser") as window:
        window.open(attack / pictures / "index.html")
        rows = "document.querySelectorAll('#trials tbody tr')"
        assert window.run(f"return {rows}.length") == len(TEXTS) + 1  # and the link, which is not followed
        shown = []
        for k in range(len(TEXTS) + 1):
            window.run(f"{rows}[{k}].click()")
            shown += window.run(_LOADED)
            window.run("document.getElementById('close').click()")
        waited = "return new Promise(done => setTimeout(() => done(window.hacked ?? null), 300))"
        assert window.run(waited) is None
        assert window.console() == []
    assert len(shown) == len(TEXTS) * len(PICTURES)
    for address, width in shown:
        assert width == 8, address
        if pictures == "embed":
            assert address.startswith("data:image/jpeg;base64,")
        else:
            parts = urlsplit(address)
            assert (parts.scheme, parts.query, parts.fragment) == ("file", "", "")
            assert unquote(parts.path).startswith(f"{attack.resolve()}/r/0000000")


# The address and the width of each picture of the open trial, once it is loaded.
_LOADED = """
return Promise.all([...document.querySelectorAll('#trial-body img')].map(async picture => {
  picture.loading = 'eager';
  await picture.decode().catch(() => null);
  return [picture.src, picture.naturalWidth];
}));
"""
