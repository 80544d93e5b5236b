"""Importing a stage in a child process, which may take too long, too much, or crash."""

from __future__ import annotations

import pickle
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, NamedTuple

from compiler.usd.options import Isolation, StageOptions
from compiler.usd.transfer import from_bytes, to_bytes
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic
from dsl.scene import Group, SceneGraph
from dsl.spans import PrimPlace

_ROOT = Path(__file__).parents[2]
_MEMORY = 17
"""How the child ends when it may not have more memory."""

_OUT_OF_MEMORY = ("bad_alloc", "Memory allocation", "unable to allocate")
"""What libraries say that end then: the standard library of C++, OpenBLAS, NumPy."""

_SMALLEST = """#usda 1.0
def Mesh "face" {
    int[] faceVertexCounts = [3]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
}
"""
"""Read before memory is counted: what usd-core and NumPy take for any stage is not the stage's."""


def import_isolated(
    path: str,
    time: float | Literal["earliest"] | None,
    prim: str | None,
    options: StageOptions,
    isolation: Isolation,
) -> tuple[SceneGraph, list[Diagnostic]]:
    """As `compiler.usd.import_stage`; what becomes of the child is among the diagnostics."""
    order = _Order("import", (path, time, prim, options))
    content, fault = _done(path, order, isolation)
    if content is not None:
        graph, faults = from_bytes(content)
        if isolation.memory is not None:
            faults = [_doubted(fault) for fault in faults]
        return graph, faults
    return SceneGraph(Group(()), path, {path: ""}), [] if fault is None else [fault]


def summarize_isolated(
    path: str,
    time: float | Literal["earliest"] | None,
    options: StageOptions,
    drawn: list[str],
    isolation: Isolation,
) -> dict[str, Any]:
    """As `compiler.usd.summary.summarize_stage`; empty whatever goes wrong."""
    content, _ = _done(path, _Order("summarize", (path, time, options, drawn)), isolation)
    return pickle.loads(content) if content is not None else {}


class _Order(NamedTuple):
    """What a child is to do."""

    task: Literal["import", "summarize"]
    arguments: tuple[Any, ...]


def _done(path: str, order: _Order, isolation: Isolation) -> tuple[bytes | None, Diagnostic | None]:
    """What the child answers, or what became of it."""
    with TemporaryDirectory(prefix="ovolo-") as folder:
        answer = Path(folder) / "answer"
        # The folder of our packages, and the parent's own way to all others.
        start = f"import sys; sys.path[:0] = {[str(_ROOT), *sys.path]!r}"
        try:
            done = subprocess.run(
                [sys.executable, "-c", f"{start}\nfrom {__name__} import serve; serve()"],
                input=pickle.dumps((order, isolation.memory, str(answer))),
                capture_output=True,
                timeout=isolation.seconds,
            )
        except subprocess.TimeoutExpired:
            message = f"the stage is not imported after {isolation.seconds:g} s"
            return None, _fault(path, "usd-deadline", message, "allow more time, or less of it")
        if done.returncode == 0:
            return answer.read_bytes(), None
        out = done.stderr.decode(errors="replace")
        end = _end(done.returncode)
        if isolation.memory is None:
            return None, _fault(path, "usd-crash", f"usd-core fails at this stage ({end})", None)
        allowed = f"{isolation.memory:,} byte{'' if isolation.memory == 1 else 's'}"
        if done.returncode == _MEMORY or any(words in out for words in _OUT_OF_MEMORY):
            message = f"the stage needs more than {allowed} to be imported"
            return None, _fault(path, "usd-memory", message, "allow more, or less of the stage")
        message = f"usd-core fails at this stage ({end}), which may take {allowed}"
        return None, _fault(path, "usd-crash", message, "more memory may mend it")


def _doubted(fault: Diagnostic) -> Diagnostic:
    """A fault of a child that may have been for want of memory."""
    if fault.code == "usd-open" and fault.help is None:
        return replace(fault, help="more memory may mend it")
    return fault


def _end(code: int) -> str:
    if code < 0:
        return signal.Signals(-code).name
    return f"exit code {code}"


def _fault(path: str, code: str, message: str, help: str | None) -> Diagnostic:
    return diagnostic(code, message, PrimPlace(path, "/"), help=help)


def serve() -> None:
    """What the child does: read an order, carry it out, write the answer to a file."""
    order, memory, answer = pickle.loads(sys.stdin.buffer.read())
    from compiler.usd.stage import read_stage
    from compiler.usd.summary import summarize_stage

    if memory is not None:
        smallest = Path(answer).with_name("smallest.usda")
        smallest.write_text(_SMALLEST)
        read_stage(str(smallest), None, None, StageOptions())
        _limit_memory(memory)
    try:
        if order.task == "import":
            content = to_bytes(*read_stage(*order.arguments))
        else:
            content = pickle.dumps(summarize_stage(*order.arguments))
        Path(answer).write_bytes(content)
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
