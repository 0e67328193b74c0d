"""Small trials, some of which go wrong on purpose: an index that raises, crashes, hangs or hoards memory."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.small import SMALL_TRIAL

MODULE = """
import ctypes
import os
import signal
import time
from dataclasses import dataclass
from typing import ClassVar

import numpy as np


@dataclass(frozen=True)
class PlantedParameters:
    fault: str = "none"


class Planted:
    parameters: ClassVar[type] = PlantedParameters

    def __init__(self, parameters, n_f, quality=None):
        if parameters.fault == "exception":
            raise ValueError("planted")
        if parameters.fault == "segfault":
            os.kill(os.getpid(), signal.SIGSEGV)
        while parameters.fault == "hang":
            time.sleep(0.01)
        if parameters.fault == "memory":
            self.hoard = [np.ones(2**22) for _ in range(1000)]
        if parameters.fault == "memory_of_c":
            library = ctypes.CDLL(None)
            library.malloc.restype = ctypes.c_void_p
            for _ in range(1000):
                library.memset(ctypes.c_void_p(library.malloc(2**25)), 1, 2**25)
        if parameters.fault == "address_space":
            self.hoard = np.zeros(2**34)
        if parameters.fault == "deadlock":
            ctypes.PyDLL(None).sleep(1000)  # holds the interpreter's lock, as a library in C may

    def propose(self, surface, vertices, moves):
        return None

    def score(self, surface, vertices):
        return 0.0
"""

SMALL = ("index=planted", "object=teddy", *SMALL_TRIAL, "record=off")


def install(folder: Path) -> Path:
    """Install the plug-in by hand: its module, and the metadata that pip would write."""
    (folder / "planted.py").write_text(MODULE)
    metadata = folder / "planted-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: planted\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text("[graspbench.index]\nplanted = planted:Planted\n")
    return folder


def sweep(plugin: Path, output: Path, *arguments: str) -> subprocess.Popen[str]:
    """Start ``graspbench sweep`` of small trials with the plug-in, in a process group of its own."""
    return _start("sweep", plugin, output, arguments)


def run(plugin: Path, output: Path, *arguments: str) -> subprocess.Popen[str]:
    """Start ``graspbench run`` of one small trial with the plug-in."""
    return _start("run", plugin, output, arguments)


def _start(command: str, plugin: Path, output: Path, arguments: Sequence[str]) -> subprocess.Popen[str]:
    given = {argument.split("=")[0] for argument in arguments}
    small = [word for word in SMALL if word.split("=")[0] not in given]
    words = [sys.executable, "-m", "graspbench.cli", command, *small, *arguments, "-o", str(output)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(plugin), *sys.path])}
    return subprocess.Popen(
        words, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    )  # fmt: skip
