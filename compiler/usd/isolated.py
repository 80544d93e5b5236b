"""Importing a stage in a child process, which may take too long, too much, or crash."""

from __future__ import annotations

import pickle
import signal
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

from compiler.usd.options import Isolation, StageOptions
from compiler.usd.transfer import from_bytes, to_bytes
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic
from dsl.scene import Group, SceneGraph
from dsl.spans import PrimPlace

_ROOT = Path(__file__).parents[2]
_MEMORY = 17
"""How the child ends when it may not have more memory."""


def import_isolated(
    path: str,
    time: float | Literal["earliest"] | None,
    prim: str | None,
    options: StageOptions,
    isolation: Isolation,
) -> tuple[SceneGraph, list[Diagnostic]]:
    """As `compiler.usd.import_stage`; what becomes of the child is among the diagnostics."""
    with TemporaryDirectory(prefix="ovolo-") as folder:
        answer = Path(folder) / "graph"
        order = pickle.dumps((path, time, prim, options, isolation, str(answer)))
        # The folder of our packages, and the parent's own way to all others.
        start = f"import sys; sys.path[:0] = {[str(_ROOT), *sys.path]!r}"
        try:
            done = subprocess.run(
                [sys.executable, "-c", f"{start}\nfrom {__name__} import serve; serve()"],
                input=order,
                capture_output=True,
                timeout=isolation.seconds,
            )
        except subprocess.TimeoutExpired:
            message = f"the stage is not imported after {isolation.seconds:g} s"
            return _failed(path, "usd-deadline", message, "allow more time, or less of the stage")
        if done.returncode == 0:
            return from_bytes(answer.read_bytes())
        out = done.stderr.decode(errors="replace")
        if isolation.memory is not None and (done.returncode == _MEMORY or "bad_alloc" in out):
            message = f"the stage needs more than {isolation.memory:,} bytes to be imported"
            return _failed(path, "usd-memory", message, "allow more, or less of the stage")
        return _failed(path, "usd-crash", f"usd-core fails at this stage ({_end(done.returncode)})")


def _end(code: int) -> str:
    if code < 0:
        return signal.Signals(-code).name
    return f"exit code {code}"


def _failed(
    path: str, code: str, message: str, help: str | None = None
) -> tuple[SceneGraph, list[Diagnostic]]:
    return SceneGraph(Group(()), path, {path: ""}), [
        diagnostic(code, message, PrimPlace(path, "/"), help=help)
    ]


def serve() -> None:
    """What the child does: read an order, import, write the answer to a file."""
    path, time, prim, options, isolation, answer = pickle.loads(sys.stdin.buffer.read())
    from compiler.usd.stage import read_stage

    if isolation.memory is not None:
        _limit_memory(isolation.memory)
    try:
        Path(answer).write_bytes(to_bytes(*read_stage(path, time, prim, options)))
    except MemoryError:
        sys.exit(_MEMORY)


def _limit_memory(more: int) -> None:
    """Allow `more` bytes of address space beyond what is used now; not on every system."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
    except (ImportError, OSError):
        return
    limit = pages * resource.getpagesize() + more
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
