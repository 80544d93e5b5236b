from __future__ import annotations

import pytest

from dsl.evaluate import evaluate_source
from dsl.files import Files
from dsl.language_service.navigation import definition, references
from dsl.language_service.program import Defined, Program
from dsl.language_service.project import Project
from dsl.language_service.rename import RefusedError, rename
from dsl.spans import Source
from tests.dsl.language_service.editing import at_cursor

BRICKS = """/// white
let snow = matte(color: #ffffff)
fn brick(size = 1, bevel = 0.1) { box((size, size, size), bevel: bevel) }
"""
MAIN = """use "bricks.ovo" as bricks
let n = 3
for i in 0..n {
  bricks.brick(size: n, bevel: 0.2).translate(i, 0, 0).material(bricks.snow)
}
"""


def renamed(text: str, name: str, **others: str) -> dict[str, str]:
    """The texts after a renaming, by file."""
    project, program, offset = at_cursor(text, **others)
    result = {}
    for path, edits in rename(project, program, offset, name).items():
        other = project.program(path)
        assert other is not None
        changed = other.encoded
        for span, new in sorted(edits, key=lambda edit: -edit[0].start):
            changed = changed[: span.start] + new.encode() + changed[span.end :]
        result[path.rpartition("/")[2]] = changed.decode()
    return result


def test_definitions_across_files() -> None:
    project, program, offset = at_cursor(MAIN.replace("bricks.snow", "bricks.sn‸ow"), bricks=BRICKS)
    found = definition(project, program, offset)
    assert found is not None
    assert found.source.name == "/scenes/bricks.ovo"
    assert BRICKS.encode()[found.start : found.end] == b"snow"
    project, program, offset = at_cursor(MAIN.replace("bricks.ovo", "bri‸cks.ovo"), bricks=BRICKS)
    found = definition(project, program, offset)
    assert found is not None
    assert (found.source.name, found.start) == ("/scenes/bricks.ovo", 0)


def test_references_in_all_files() -> None:
    text = BRICKS.replace("size = 1", "si‸ze = 1")
    project = Project()
    before = text.partition("‸")[0]
    project.open("/scenes/bricks.ovo", BRICKS)
    project.open("/scenes/main.ovo", MAIN)
    program = project.program("/scenes/bricks.ovo")
    assert program is not None
    found = references(project, program, len(before.encode()))
    places = [(r.span.source.name.rpartition("/")[2], r.is_definition) for r in found]
    assert places == [("bricks.ovo", True)] + [("bricks.ovo", False)] * 3 + [("main.ovo", False)]


def test_a_name_is_renamed_everywhere_it_is_meant() -> None:
    text = (
        "let a = 1\nlet b = a + a\nfor i in 0..a { let a = 2\nsphere(radius: a) }\nbox((‸a, a, a))"
    )
    assert renamed(text, "größe") == {
        "main.ovo": "let größe = 1\nlet b = größe + größe\nfor i in 0..größe { let a = 2\n"
        "sphere(radius: a) }\nbox((größe, größe, größe))"
    }


def test_a_name_of_another_file_is_renamed_in_both() -> None:
    found = renamed(MAIN.replace("bricks.snow", "bricks.‸snow"), "white", bricks=BRICKS)
    assert found == {
        "main.ovo": MAIN.replace("snow", "white"),
        "bricks.ovo": BRICKS.replace("let snow", "let white"),
    }


def test_a_parameter_is_renamed_with_the_arguments_that_name_it() -> None:
    found = renamed("fn f(‸a, b) { sphere(radius: a) }\nf(b: 1, a: 2)", "x")
    assert found == {"main.ovo": "fn f(x, b) { sphere(radius: x) }\nf(b: 1, x: 2)"}
    found = renamed(MAIN.replace("size: n", "si‸ze: n"), "edge", bricks=BRICKS)
    assert found["bricks.ovo"] == BRICKS.replace("size", "edge")


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("let a‸ = 1\nlet b = 2\nbox((a, b, 1))", "b"),  # defined already
        ("let a‸ = 1\nfn f(b) { sphere(radius: a + b) }", "b"),  # captured by a parameter
        ("let a = 1\nfn f(b‸) { sphere(radius: a + b) }", "a"),  # would capture
        ("let a‸ = 1\nlet s = sphere()", "sphere"),  # would capture a builtin
        ("let a‸ = 1\nbox((a, c, 1))", "c"),  # would define what is not
        ("let a‸ = 1", "let"),
        ("let a‸ = 1", "time"),
        ("let a‸ = 1", "a b"),
        ("let a‸ = 1", "1a"),
        ("let a‸ = 1", ""),
        ("let a‸ = 1", "// x"),
        ("sph‸ere()", "ball"),
        ("fn f(a‸) { sphere(radius: a) }\nlet g = f\ng(a: 1)", "x"),  # calls that are not known
    ],
)
def test_a_renaming_that_would_change_a_meaning_is_refused(text: str, name: str) -> None:
    with pytest.raises(RefusedError):
        renamed(text, name)


def test_a_file_that_is_handed_on_is_not_renamed_in() -> None:
    main = 'use "bricks.ovo" as bricks\nlet b = bricks\nbox().material(bricks.‸snow)'
    with pytest.raises(RefusedError, match="as a value"):
        renamed(main, "white", bricks=BRICKS)


def test_every_accepted_renaming_keeps_the_scene() -> None:
    text = (
        "let a = 2\nfn f(b, c = a) { let d = b\nfor e in 0..2 { sphere(radius: d + c + e) } }\n"
        "f(b: 1)\nf(1, c: a)\nlet g = { let a = 3\nf(a) }\ng\n"
    )
    project, program, _ = at_cursor(text)
    accepted = 0
    for node in program.resolution.definitions:
        assert isinstance(node, Defined)
        for name in ("a", "b", "c", "d", "e", "f", "g", "new", "radius", "sphere"):
            try:
                edits = rename(project, program, node.name_span.start, name)
            except RefusedError:
                continue
            accepted += name != node.name
            changed = program.encoded
            for span, new in sorted(edits[program.path], key=lambda edit: -edit[0].start):
                changed = changed[: span.start] + new.encode() + changed[span.end :]
            assert radii(changed.decode()) == radii(text), (node.name, name)
    assert accepted > 20


def radii(text: str) -> list[float]:
    from compiler.compilation import compile_text

    graph, faults = evaluate_source(Source("t.ovo", text), Files())
    assert graph is not None, faults
    return [float(x) for x in compile_text(text).ir.shape_parameters]


def test_programs_read_from_disk_are_searched(tmp_path: object) -> None:
    from pathlib import Path

    folder = Path(str(tmp_path))
    (folder / "bricks.ovo").write_text(BRICKS)
    (folder / "main.ovo").write_text(MAIN)
    project = Project((str(folder),))
    program = project.program(str(folder / "bricks.ovo"))
    assert isinstance(program, Program)
    edits = rename(project, program, BRICKS.index("snow"), "white")
    assert {path.rpartition("/")[2] for path in edits} == {"main.ovo", "bricks.ovo"}
