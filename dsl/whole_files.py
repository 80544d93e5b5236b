"""Files that are written whole, or not at all."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Where to write what shall be at `path`: it comes to be there when all is written.

    Until then, and if an error or Ctrl-C ends it before, `path` is as it was. A symbolic link stays
    one, and a file that is replaced passes on its permissions. What is no regular file, such as a
    pipe, or lies in a folder where nothing can be made, is written in place.
    """
    target = path.resolve()
    exists = target.exists()
    if exists and not (target.is_file() and os.access(target.parent, os.W_OK)):
        yield target
        return
    unfinished = target.with_name(f".ovolo-{os.urandom(4).hex()}{target.suffix}")
    try:
        yield unfinished
        if exists:
            unfinished.chmod(stat.S_IMODE(target.stat().st_mode))
        unfinished.replace(target)
    finally:
        unfinished.unlink(missing_ok=True)
