"""The user's own folder for files that can be made again."""

import atexit
import os
import shutil
import stat
import tempfile
from functools import lru_cache
from pathlib import Path


@lru_cache(maxsize=8)
def user_cache(name: str) -> Path:
    """Return a folder for cached files that nobody but this user can write.

    It is ``$XDG_CACHE_HOME/graspbench/NAME``, or ``~/.cache/graspbench/NAME``. Where that belongs to somebody
    else, can be written by others or cannot be made, a new folder takes its place until the process ends.

    Args:
        name: What is cached there.
    """
    root = os.environ.get("XDG_CACHE_HOME", "")
    base = Path(root) if os.path.isabs(root) else Path.home() / ".cache"
    folder = base / "graspbench" / name
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if _is_ours(folder) and _is_ours(folder.parent):
            return folder
    except (OSError, RuntimeError):
        pass
    own = tempfile.mkdtemp(prefix="graspbench-")
    atexit.register(shutil.rmtree, own, ignore_errors=True)
    return Path(own)


def _is_ours(folder: Path) -> bool:
    """Tell whether a folder is no link, this user's, writable, and closed to the writing of others."""
    found = folder.lstat()
    others = stat.S_IWGRP | stat.S_IWOTH
    return (
        stat.S_ISDIR(found.st_mode)
        and found.st_uid == os.getuid()
        and not found.st_mode & others
        and os.access(folder, os.W_OK)
    )
