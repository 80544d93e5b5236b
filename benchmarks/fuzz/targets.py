"""What is fuzzed: each target takes an input and raises where something is wrong with us.

Whatever the input, the answer is a result or diagnostics, in bounded time and memory.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from compiler.flatten import flatten
from compiler.ir import COLUMNS, SceneIR
from compiler.ir_binary import read_ir, write_ir
from compiler.ir_parse import parse_ir
from compiler.ir_text import print_ir
from compiler.provenance import object_path, source_place
from dsl import alike, ast, lanes, sizes
from dsl.budget import Limits
from dsl.codes import diagnostic
from dsl.diagnostics import CompileError, Diagnostic
from dsl.evaluate import evaluate, evaluate_source
from dsl.files import FileFault, Files
from dsl.format import format_source
from dsl.parser import parse
from dsl.render_diagnostic import render_diagnostics, to_json
from dsl.scene import File, Group, Node, SceneGraph
from dsl.spans import Source, Span

LIMITS = Limits(
    source_bytes=100_000, steps=50_000, call_depth=100, iterations=2_000, nodes=5_000,
    list_length=5_000, string_length=1_000, files=4,
)  # fmt: skip
"""Small, so that inputs that use up their budget do not use up ours."""


class NoFiles(Files):
    """Every file is missing."""

    def resolve(self, path: str, folder: str = "", max_bytes: int | None = None) -> Path:
        """Raise FileFault."""
        raise FileFault("file-missing", f"`{path[:40]}` does not exist")


def program(text: str) -> None:
    """Lex, parse, evaluate, flatten; tell what is wrong in every form."""
    source = Source("scene.ovo", text)
    graph, found = evaluate_source(source, NoFiles(), LIMITS)
    assert (graph is None) is any(each.severity == "error" for each in found)
    if graph is not None:
        ir, more, _ = flatten(graph, _no_file)
        assert (ir is None) is any(each.severity == "error" for each in more)
        found = [*found, *more]
    _check_told(found, source)


def formatter(text: str) -> None:
    """Formatting is refused for faulty syntax, or keeps the meaning, and changes nothing twice."""
    source = Source("scene.ovo", text)
    formatted, faults = format_source(source, LIMITS)
    assert (formatted is None) == bool(faults)
    _check_told(faults, source)
    if formatted is not None:
        assert meaning(formatted) == meaning(text)
        assert format_source(Source("scene.ovo", formatted), LIMITS)[0] == formatted


def meaning(text: str) -> object:
    """The syntax tree of a program without its places."""

    def plain(node: object) -> object:
        if isinstance(node, tuple):
            return tuple(map(plain, node))
        if hasattr(node, "__dataclass_fields__"):
            fields = (getattr(node, name) for name in node.__dataclass_fields__)
            return (type(node).__name__, *(plain(f) for f in fields if not isinstance(f, Span)))
        return node

    module, faults = parse(Source("scene.ovo", text))
    assert not faults
    return plain(module.body)


_PLACES = {
    *("instance_source", "source_parent", "source_origin", "source_index", "origins"),
    *("text_ends", "text_bytes"),
}
"""Columns that tell where leaves come from: what they tell is to agree, not how it is packed."""


def ways(*texts: str) -> None:
    """Loops evaluated in all iterations at once, and one after the other, are the same scene.

    That of several programs is the group of theirs: it is flattened in the time of one.
    """
    modules = [parse(Source("scene.ovo", text)) for text in texts]
    assert not any(faults for _, faults in modules)
    judge, expected, faults = _compiled([module for module, _ in modules], 10**9)
    graph, ir, found = _compiled([module for module, _ in modules], 1)
    assert found == faults
    assert (ir is None) is (expected is None)
    if expected is None or ir is None or judge is None or graph is None:
        return
    for column in COLUMNS.keys() - _PLACES:
        assert getattr(ir, column).tobytes() == getattr(expected, column).tobytes(), column
    count = len(expected.instance_target)
    for leaf in {0, 1, count // 3, count // 2, count - 2, count - 1}.intersection(range(count)):
        assert object_path(ir, leaf) == object_path(expected, leaf)
        assert source_place(ir, leaf, graph.sources) == source_place(expected, leaf, judge.sources)


def lines_alike(text: str) -> None:
    """Lines of one form read and evaluated at once are the same scene as one by one."""
    judge, faults = _compiled_lines(text, 10**9)
    ir, found = _compiled_lines(text, 2)
    assert found == faults
    assert (ir is None) is (judge is None)
    if ir is not None and judge is not None:
        for column in COLUMNS:
            assert getattr(ir, column).tobytes() == getattr(judge, column).tobytes(), column


def ir_text(text: str) -> None:
    """A text of the IR is refused, or printed back as what reads as the same."""
    try:
        scene = parse_ir(text)
    except CompileError as error:
        _check_told(error.diagnostics, Source("scene.ir", text))
        return
    printed = print_ir(scene, sources=True)
    assert print_ir(parse_ir(printed), sources=True) == printed


def ir_binary(content: bytes, path: Path) -> None:
    """A binary IR, written to `path`, is refused, or written back as what reads as the same."""
    path.write_bytes(content)
    try:
        scene = read_ir(path)
    except CompileError as error:
        _check_told(error.diagnostics, None)
        return
    other = path.with_suffix(".again")
    write_ir(scene, other)
    again = read_ir(other)
    for name in COLUMNS:
        assert getattr(scene, name).tobytes() == getattr(again, name).tobytes(), name


def _compiled(
    modules: Sequence[ast.Module], fewest: int
) -> tuple[SceneGraph | None, SceneIR | None, list[Diagnostic]]:
    """The scene of programs whose loops of so many iterations are evaluated at once."""
    found: list[Diagnostic] = []
    roots: list[Node] = []
    with _lanes_from(fewest):
        for module in modules:
            graph, faults = evaluate(module, NoFiles())
            found += faults
            if graph is not None:
                roots.append(graph.root)
        if not roots:
            return None, None, found
        whole = SceneGraph(roots[0] if len(roots) == 1 else Group(tuple(roots)))
        ir, more, _ = flatten(whole, _no_file)
    return whole, ir, found + more


def _compiled_lines(text: str, fewest: int) -> tuple[SceneIR | None, list[Diagnostic]]:
    """The scene of a program whose lines of so many of one form are evaluated at once."""
    before = alike.FEWEST, sizes.MOST
    alike.FEWEST, sizes.MOST = fewest, 2
    try:
        graph, found = evaluate_source(Source("scene.ovo", text), NoFiles())
        if graph is None:
            return None, found
        ir, more, _ = flatten(graph, _no_file)
        return ir, [*found, *graph.advice, *more]
    finally:
        alike.FEWEST, sizes.MOST = before


@contextmanager
def _lanes_from(fewest: int) -> Iterator[None]:
    before = lanes.FEWEST, sizes.MOST
    lanes.FEWEST, sizes.MOST = fewest, 2  # programs of few iterations have few sizes
    try:
        yield
    finally:
        lanes.FEWEST, sizes.MOST = before


def _no_file(file: File) -> tuple[Node | None, list[Diagnostic]]:
    return None, [diagnostic("file-missing", "there are no files")]


def _check_told(found: list[Diagnostic], source: Source | None) -> None:
    """Diagnostics are few, can be shown, and lie inside of the text."""
    assert len(found) <= LIMITS.diagnostics + 2
    render_diagnostics(found)
    size = len(source.encoded()) if source is not None else 0
    for each in found:
        to_json(each)
        for label in (each.primary, *each.secondary):
            if label is not None and isinstance(label.place, Span) and label.place.source == source:
                assert 0 <= label.place.start <= label.place.end <= size


TextTarget = Callable[[str], None]
TEXT_TARGETS: dict[str, TextTarget] = {
    "program": program,
    "formatter": formatter,
    "ways": ways,
    "lines_alike": lines_alike,
    "ir_text": ir_text,
}
"""The targets that take a text."""
