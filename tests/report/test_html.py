"""The report's page: what is in it, and that it works in a browser without a network."""

import base64
import contextlib
import io
import json
import os
import re
from csv import reader as csv_reader
from pathlib import Path
from xml.etree import ElementTree

import cv2
import numpy as np
import pandas as pd
import pytest

from graspbench.errors import LogError
from graspbench.report import html
from graspbench.report.geometry import read_geometry, trial_geometry, unpack_points, write_geometry
from graspbench.report.html import write_page
from graspbench.report.tables import plain_table
from graspbench.simulation import film
from tests.report import browser

NAMES = ("teddy", "duck", "bottle", "teddy", "duck", "</script><b>mug")


@pytest.fixture
def experiment(tmp_path, trial, paths):
    """Six trials with geometry and pictures for the first four; one failed."""
    rows, folders = [], {}
    for k, name in enumerate(NAMES):
        trial_id = f"{k:010x}"
        failed = k == 4
        row = {
            "trial_id": trial_id, "status": "failed" if failed else "done", "success": not failed,
            "reason": "no grasp meets the constraints." if failed else None, "object.name": name,
            "hand.name": "radial", "index.name": "force_field", "seed": k,
            "local.q1": None if failed else 0.1 * (k + 1),
            "ratio.q1": None if failed else 1.0 - 0.1 * k, "times_s.images": 1.0 + k, "constant": 7,
        }  # fmt: skip
        rows.append(row)
        folders[trial_id] = tmp_path / "results" / trial_id
        folders[trial_id].mkdir(parents=True)
        if k < 4:
            write_geometry(*trial_geometry(trial.surfaces[-1], trial.grasp, paths), folders[trial_id])
            cv2.imwrite(str(folders[trial_id] / "grasp.png"), np.full((90, 120, 3), 40 * k, np.uint8))
        if k == 1:
            _write_film(folders[trial_id] / "execution.mp4")
    return pd.DataFrame(rows), folders


def _write_film(path):
    codec, _ = film._CODECS[0]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), 12.0, (64, 48))
    for k in range(3):
        writer.write(np.full((48, 64, 3), 80 * k, np.uint8))
    writer.release()


def test_geometry_is_kept_to_a_hundredth_of_a_millimetre(trial, paths, tmp_path):
    surface = trial.surfaces[-1]
    shared = {}
    path = write_geometry(*trial_geometry(surface, trial.grasp, paths), tmp_path)
    geometry = read_geometry(path, shared)
    (mesh,) = geometry["meshes"]
    np.testing.assert_allclose(unpack_points(mesh["points"]), surface.points, atol=1e-5)
    faces = np.frombuffer(base64.b64decode(shared[mesh["faces"]]), dtype="<u2")
    np.testing.assert_array_equal(faces.reshape(-1, 3), surface.network.faces)
    assert len(geometry["contacts"]) == len(geometry["paths"]) == 3
    np.testing.assert_allclose(geometry["contacts"][0]["point"], trial.grasp.points[0], atol=1e-5)


def test_page_is_one_file_that_asks_for_nothing_else(experiment, tmp_path):
    trials, folders = experiment
    page = write_page(trials, tmp_path / "report", folders).read_text()
    assert re.findall(r"""(?:src|href|url)\s*[=(]\s*["']?(?!data:)[a-z.]*[:/]""", page) == []
    assert page.count("data:image/jpeg;base64,") == 4
    assert "</script><b>mug" not in page
    assert [path.name for path in (tmp_path / "report").iterdir()] == ["index.html"]


def test_pictures_of_many_trials_are_linked_to(experiment, tmp_path):
    trials, folders = experiment
    page = write_page(trials, tmp_path / "results" / "report", folders, pictures="link").read_text()
    addresses = re.findall(r'\["picture","grasp","([^"]+)"\]', page)
    assert len(addresses) == 4
    assert all((tmp_path / "results" / "report" / address).is_file() for address in addresses)


def test_what_reads_and_says_the_same_is_offered_once():
    names = ["teddy", "duck", "own"]
    trials = pd.DataFrame({
        "trial_id": ["a", "b", "c"], "status": "done", "object.name": names, "choice.object": names,
        "choice.quality": ["default", "thesis", "thesis"], "hand.fingers": [3, 4, 4],
    })  # fmt: skip
    told = html._document(trials)
    for offered in ("shown", "filters", "groups"):
        heads = [html._heading(name) for name in told[offered]]
        assert len(heads) == len(set(heads)), offered
        assert "object" in heads
    trials.loc[2, "choice.object"] = "mesh"  # now it says something else
    assert {"object.name", "choice.object"} <= set(html._document(trials)["filters"])


def test_no_trials_make_no_page(tmp_path):
    with pytest.raises(LogError, match="the trials are none"):
        write_page(pd.DataFrame(), tmp_path / "report", {})
    assert not (tmp_path / "report").exists()


@pytest.mark.skipif(not browser.AVAILABLE, reason=browser.REASON)
def test_page_sorts_filters_and_draws_in_a_browser(experiment, tmp_path):
    trials, folders = experiment
    page = write_page(trials, tmp_path / "report", folders, title="six <trials>")
    with browser.browser(tmp_path / "browser") as window:
        window.resize(1200, 900)
        window.open(page)
        _sorts_and_filters(window)
        _shows_a_trial(window)
        _plays_a_film(window)
        _saves_plots(window)
        _keeps_filters_in_the_address(window, page)
        window.resize(390, 844)
        window.open(page)
        assert window.run("return document.documentElement.scrollWidth") <= 390
        assert window.console() == []


def _keeps_filters_in_the_address(window, page):
    window.run("location.hash = ''; location.reload()")
    pick = """
        const box = document.getElementById(arguments[0]); box.value = arguments[1];
        box.dispatchEvent(new Event('change'));
    """
    window.run(pick, "filter-object.name", "duck")
    window.run(pick, "choice-group", "object.name")
    address = window.run("return location.href")
    assert "object.name=duck" in address
    window.run("location.href = 'about:blank'")
    window.run("location.href = arguments[0]", address)
    assert window.run("return document.getElementById('filter-object.name').value") == "duck"
    assert "2 of 6 trials" in window.run("return document.getElementById('summary').textContent")


def _saves_plots(window):
    kept = """
        window.saved = [];
        URL.createObjectURL = blob => { blob.text().then(text => window.saved.push(text)); return 'blob:x'; };
        HTMLAnchorElement.prototype.click = function () { window.named = this.download; };
        for (const kind of ['svg', 'csv']) document.getElementById(`save-strip-${kind}`).click();
    """
    window.run(kept)
    svg, csv = window.run("return new Promise(done => setTimeout(() => done(window.saved), 200))")
    root = ElementTree.fromstring(svg)
    assert root.tag == "{http://www.w3.org/2000/svg}svg"
    assert root.findall(".//{*}circle")
    rows = list(csv_reader(io.StringIO(csv)))
    assert rows[0] == ["trial_id", "object.name", "ratio.q1"]
    assert len(rows) == 1 + len(root.findall(".//{*}circle"))
    assert window.run("return window.named") == "strip.csv"


def _sorts_and_filters(window):
    assert window.run("return document.querySelector('h1').textContent") == "six <trials>"
    column = """
        const heads = [...document.querySelectorAll('#trials th')];
        const at = heads.findIndex(head => head.dataset.column === arguments[0]);
        return [...document.querySelectorAll('#trials tbody tr')].map(r => r.children[at].textContent);
    """
    click = "document.querySelector(`#trials th[data-column='${arguments[0]}']`).click()"
    pick = """
        const box = document.getElementById(arguments[0]); box.value = arguments[1];
        box.dispatchEvent(new Event(box.tagName === 'SELECT' ? 'change' : 'input'));
    """
    window.run(click, "local.q1")
    assert window.run(column, "local.q1") == ["0.1", "0.2", "0.3", "0.4", "0.6", "-"]
    window.run(click, "local.q1")
    assert window.run(column, "local.q1") == ["0.6", "0.4", "0.3", "0.2", "0.1", "-"]
    window.run(pick, "filter-object.name", "teddy")
    assert window.run(column, "object.name") == ["teddy", "teddy"]
    assert "2 of 6 trials" in window.run("return document.getElementById('summary').textContent")
    window.run(pick, "filter-object.name", "")
    window.run(pick, "search", "no grasp")
    assert window.run(column, "status") == ["failed"]
    window.run(pick, "search", "")
    assert window.run("return document.querySelectorAll('#plot-scatter circle').length") == 5
    assert window.run("return document.querySelectorAll('#plots svg').length") == 4


def _shows_a_trial(window):
    seen = """
        const copy = document.createElement('canvas'), view = document.getElementById('view');
        copy.width = view.width; copy.height = view.height;
        const pen = copy.getContext('2d'); pen.drawImage(view, 0, 0);
        const data = pen.getImageData(0, 0, copy.width, copy.height).data, colors = new Set();
        for (let i = 0; i < data.length; i += 4)
            if (data[i + 3]) colors.add(data[i] << 16 | data[i + 1] << 8 | data[i + 2]);
        return colors.size;
    """
    window.run("document.querySelector('#trials tbody tr:nth-child(2)').click()")
    assert window.run("return document.getElementById('trial').open") is True
    whole = window.run(seen)
    assert whole > 100  # shades of the surface, contacts and paths
    window.run("document.querySelector('.toggles input').click()")
    assert window.run(seen) < whole
    assert window.run("return document.querySelector('.pictures img').naturalWidth") == 120
    window.run("document.getElementById('next').click()")
    window.run("document.getElementById('close').click()")


def _plays_a_film(window):
    opened = """
        const at = DATA.rows.findIndex((_, i) => (DATA.media[i] || []).some(([kind]) => kind === 'film'));
        openTrial(at);
        const film = document.querySelector('.pictures video');
        film.play();
        return new Promise(done => {
            const look = left => {
                if (left && !film.error && (film.readyState < 2 || !film.currentTime))
                    return setTimeout(() => look(left - 1), 50);
                done([film.videoWidth, film.readyState, film.error && film.error.message, film.currentTime]);
                document.getElementById('close').click();
            };
            look(200);
        });
    """
    width, state, error, time_s = window.run(opened)
    assert (width, error) == (64, None)
    assert state >= 2  # HAVE_CURRENT_DATA: it is decoded
    assert time_s > 0.0


@pytest.mark.skipif(not browser.AVAILABLE, reason=browser.REASON)
def test_the_page_of_a_study_that_runs_loads_itself_again(experiment, tmp_path, monkeypatch):
    monkeypatch.setattr(html, "_AGAIN_MS", 100)
    trials, folders = experiment
    shown = "return [document.getElementById('running').textContent, DATA.rows.length, location.hash]"
    waited = "return new Promise(done => setTimeout(done, 400))"
    with browser.browser(tmp_path / "browser") as window:
        window.open(write_page(trials[:2], tmp_path / "report", folders, running="2 of 6 trials"))
        told, count, _ = window.run(shown)
        assert told.startswith("2 of 6 trials")
        assert count == 2
        window.run("location.hash = '#object.name=duck'")
        write_page(trials[:5], tmp_path / "report", folders, running="5 of 6 trials")
        with contextlib.suppress(AssertionError):  # the page was left while the script ran
            window.run(waited)
        assert window.run(shown)[1:] == [5, "#object.name=duck"]
        write_page(trials, tmp_path / "report", folders)
        with contextlib.suppress(AssertionError):
            window.run(waited)
        assert window.run(shown) == ["", 6, "#object.name=duck"]
        assert window.run("return document.getElementById('running').hidden")


def test_every_script_of_the_page_is_used():
    folder = Path(write_page.__code__.co_filename).parent / "page"
    text = (folder.parent / "html.py").read_text()
    assert all(path.name in text for path in folder.iterdir())


HOSTILE = (
    "</script><script>window.hacked=1</script>", "{{geometry}}", "{{data}}", "{% raw %}",
    "<img src=x onerror=hacked=1>",
    "\"><svg onload=hacked=1>", "javascript:hacked=1", "__proto__", "../../../etc/passwd",
    "=cmd|'/c calc'!A1", "\\input{/etc/passwd}",
)  # fmt: skip


@pytest.fixture
def attack(tmp_path, trial, paths):
    """A results folder of an attacker: names, ids, links, and files that are not what they seem."""
    secret = tmp_path / "secret.png"
    cv2.imwrite(str(secret), np.full((8, 8, 3), 255, np.uint8))
    rows, folders = [], {}
    for k, text in enumerate(HOSTILE):
        rows.append(
            {
                "trial_id": text, "status": "done", "success": None if k % 2 else bool(k % 4),
                "reason": text, "object.name": text, "hand.name": "radial", "index.name": text, "seed": k,
                "local.q1": 0.1 * k,
                f"choice.{text}": text, "ratio.q1": 0.5,
            }
        )  # fmt: skip
        folder = tmp_path / "results" / f"{k:010x}"
        folder.mkdir(parents=True)
        folders[text] = folder
        (folder / "link.png").symlink_to(secret)
        (folder / "fake.png").write_text("<script>window.hacked=1</script>")
        cv2.imwrite(str(folder / "a'onerror=hacked=1 %22.png"), np.zeros((8, 8, 3), np.uint8))
        write_geometry(*trial_geometry(trial.surfaces[-1], trial.grasp, paths), folder)
    for k, content in enumerate((b"", b"{", b"\xff\xfe", b"[" * 100_000, b'{"meshes":"</script>"}\n{}')):
        (folders[HOSTILE[k]] / "geometry.jsonl").write_bytes(content)
    os.remove(folders[HOSTILE[5]] / "geometry.jsonl")
    os.mkfifo(folders[HOSTILE[5]] / "geometry.jsonl")
    return pd.DataFrame(rows), folders


@pytest.mark.parametrize("pictures", ["embed", "link"])
def test_a_hostile_folder_gives_a_page_that_reads_nothing_outside_it(attack, tmp_path, pictures):
    trials, folders = attack
    page = write_page(trials, tmp_path / "out", folders, title=HOSTILE[0], pictures=pictures)
    text = page.read_text()
    assert "<script>window.hacked" not in text
    assert "secret" not in text
    assert text.count("link.png") == 0
    assert len(re.findall(r'id="geometry-', text)) == len(HOSTILE) - 6
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])
    assert {kind for media in data["media"].values() for kind, _, _ in media} == {"picture"}
    for media in data["media"].values():
        for _, _, address in media:
            assert address.startswith(("data:image/jpeg;base64,", "./../results/0"))
            assert "'" not in address


def test_an_array_of_one_trial_cannot_be_changed_by_another(tmp_path, trial, paths):
    geometry, arrays = trial_geometry(trial.surfaces[-1], trial.grasp, paths)
    name = next(iter(arrays))
    (tmp_path / "a").mkdir()
    bad = write_geometry(geometry, {name: "AAAA"}, tmp_path / "a")
    shared = {}
    assert read_geometry(bad, shared) is None
    assert shared == {}


@pytest.mark.skipif(not browser.AVAILABLE, reason=browser.REASON)
def test_a_hostile_folder_executes_nothing_in_a_browser(attack, tmp_path):
    trials, folders = attack
    tables = [plain_table("t", [{"name": text} for text in HOSTILE], HOSTILE[0], notes=HOSTILE)]
    page = write_page(trials, tmp_path / "out", folders, title=HOSTILE[0], pictures="link", tables=tables)
    with browser.browser(tmp_path / "browser") as window:
        window.resize(1200, 900)
        window.open(page)
        count = window.run("return document.querySelectorAll('#trials tbody tr').length")
        assert count == len(HOSTILE)
        assert window.run("return document.querySelector('h1').textContent") == HOSTILE[0]
        for k in range(count):
            row = f"document.querySelectorAll('#trials tbody tr')[{k}].click()"
            window.run(row + "; document.getElementById('close').click()")
        assert window.console() == []
        injected = "const s = document.createElement('script'); s.textContent = 'window.hacked = 2'; "
        window.run(injected + "document.body.append(s); document.body.insertAdjacentHTML('beforeend', "
                   "'<img src=x onerror=window.hacked=3>')")  # fmt: skip
        waited = "return new Promise(done => setTimeout(() => done(window.hacked ?? null), 300))"
        assert window.run(waited) is None
        refused = [line for line in window.console() if "Content Security Policy" in line]
        assert len(refused) == 2
