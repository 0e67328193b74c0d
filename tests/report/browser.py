"""A headless Chromium over the WebDriver protocol, by the standard library alone."""

import base64
import json
import shutil
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

AVAILABLE = shutil.which("chromium") is not None and shutil.which("chromedriver") is not None
REASON = "no chromium and chromedriver here (tests/system-tools installs them)"


class Browser:
    """One page in one window."""

    def __init__(self, address: str) -> None:
        self._address = address

    def open(self, path: Path) -> None:
        self._call("url", {"url": path.resolve().as_uri()})

    def run(self, script: str, *arguments: Any) -> Any:
        """Run a function's body in the page and return what it returns."""
        return self._call("execute/sync", {"script": script, "args": list(arguments)})

    def resize(self, width: int, height: int) -> None:
        """Give the page exactly this size, as a telephone's browser does."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        self._call("goog/cdp/execute", {"cmd": "Emulation.setDeviceMetricsOverride", "params": metrics})

    def screenshot(self, path: Path) -> None:
        with urllib.request.urlopen(f"{self._address}/screenshot", timeout=60) as answer:
            path.write_bytes(base64.b64decode(json.load(answer)["value"]))

    def console(self) -> list[str]:
        """Return what was written to the console, errors of loading included."""
        return [entry["message"] for entry in self._call("se/log", {"type": "browser"})]

    def _call(self, command: str, body: dict[str, Any]) -> Any:
        request = urllib.request.Request(
            f"{self._address}/{command}",
            json.dumps(body).encode(),
            {"Content-Type": "application/json"},
        )
        try:
            with urllib.request.urlopen(request, timeout=120) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as error:
            raise AssertionError(json.load(error)["value"]["message"]) from None


@contextmanager
def browser(folder: Path) -> Iterator[Browser]:
    """Start a browser whose files go into ``folder``; its network is shut off."""
    driver = subprocess.Popen(
        ["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    try:
        assert driver.stdout is not None
        port = next(
            line.split("on port ")[1].strip(" .\n")
            for line in driver.stdout
            if "successfully on port " in line
        )
        options = {
            "args": [
                "--headless=new", "--no-sandbox", "--disable-dev-shm-usage",
                f"--user-data-dir={folder / 'profile'}",
                "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--window-size=1280,900",
                "--proxy-server=127.0.0.1:9", "--hide-scrollbars",
            ],
        }  # fmt: skip
        wanted = {
            "browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"},
        }  # fmt: skip
        root = Browser(f"http://127.0.0.1:{port}")
        session = root._call("session", {"capabilities": {"alwaysMatch": wanted}})["sessionId"]
        address = f"http://127.0.0.1:{port}/session/{session}"
        try:
            yield Browser(address)
        finally:
            urllib.request.urlopen(urllib.request.Request(address, method="DELETE"), timeout=60).close()
    finally:
        time.sleep(0.2)
        driver.terminate()
        driver.wait(timeout=20)
        if driver.stdout is not None:
            driver.stdout.close()
