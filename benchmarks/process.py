"""Commands of ours as whole processes, the way they run once installed."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from typing import NamedTuple


class Used(NamedTuple):
    """What a process took: seconds and bytes."""

    wall: float
    cpu: float
    peak: int


def ovolo(*arguments: str) -> Used:
    """Run `ovolo` with these arguments. Raises CalledProcessError if it fails.

    It may write compiled modules, as an installed one has them: the first of several runs
    leaves them for the others, which are those to be believed.
    """
    words = [sys.executable, "-m", "ovolo", *arguments]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    start = time.perf_counter()
    process = subprocess.Popen(words, env=environment)
    _, status, used = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, words)
    return Used(wall, used.ru_utime + used.ru_stime, 1024 * used.ru_maxrss)
