"""docs/errors.md shows what beginners are told, word for word."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from dsl.evaluate import evaluate_source
from dsl.examples import Example, read_chapter
from dsl.files import Files
from dsl.render_diagnostic import render_diagnostics
from dsl.spans import Source

PAGE = Path(__file__).parent.parent.parent / "docs" / "errors.md"
MISTAKES = list(read_chapter(PAGE))


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda mistake: mistake.name)
def test_a_mistake(mistake: Example, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    _, found = evaluate_source(Source("scene.ovo", mistake.source), Files(tmp_path))
    assert len(found) == 1
    assert found[0].help
    if request.config.getoption("--update"):
        head, name, rest = PAGE.read_text().partition(f"## {mistake.name}\n")
        shown = f"```diagnostics\n{render_diagnostics(found)}```"
        rest = re.sub(
            r"^```diagnostics\n.*?^```$", lambda _: shown, rest, count=1, flags=re.M | re.S
        )
        PAGE.write_text(head + name + rest)
    else:
        assert render_diagnostics(found) == mistake.outcome


def test_there_are_twenty() -> None:
    assert len(MISTAKES) == 20
