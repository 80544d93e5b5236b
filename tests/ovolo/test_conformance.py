"""`ovolo explain` and `ovolo conformance`: the language reference at work."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from dsl.codes import CODES
from dsl.examples import read_examples
from ovolo.__main__ import main
from ovolo.conformance import judge
from ovolo.exits import Exit

OURS = f"{sys.executable} -m ovolo compile {{source}}"


def test_every_code_is_explained(capsys: pytest.CaptureFixture[str]) -> None:
    for code in ("value-bevel", "type-angle-unit", "limit-steps"):
        assert main(["explain", code]) == Exit.OK
        out = capsys.readouterr().out
        assert out.startswith(f"# error[{code}]\n\n{CODES[code].summary.capitalize()[:1]}")
        assert "```ovolo" in out
        assert f"error[{code}]: " in out


def test_an_unknown_code_has_a_suggestion(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "value-bevle"]) == Exit.USAGE
    assert "did you mean `value-bevel`?" in capsys.readouterr().err


def test_we_conform_to_our_own_reference(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent.parent.parent))
    chosen = [e for e in read_examples() if e.chapter == "bevels.md"][:3]
    chosen += [e for e in read_examples() if e.kind == "diagnostics" and e.files][:2]
    chosen += [e for e in read_examples() if e.words][:1]
    chapters = judge(chosen, OURS)
    assert [chapter.failed for chapter in chapters.values() if chapter.failed] == []
    assert sum(chapter.passed for chapter in chapters.values()) >= 3
    assert sum(chapter.skipped for chapter in chapters.values()) >= 1


def test_one_that_prints_nothing_conforms_nowhere() -> None:
    chosen = [e for e in read_examples() if e.kind in ("ir", "diagnostics") and not e.words][:3]
    chapters = judge(chosen, "true {source}")
    assert sum(len(chapter.failed) for chapter in chapters.values()) == 3


def test_the_suite_is_written_as_json(tmp_path: Path) -> None:
    target = tmp_path / "suite.json"
    assert main(["conformance", "--dump", str(target)]) == Exit.OK
    suite = json.loads(target.read_text())
    assert len(suite) == len(list(read_examples()))
    assert {"chapter", "name", "source", "kind", "outcome"} <= set(suite[0])


def test_a_command_that_cannot_be_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["conformance", "--command", "tool"]) == Exit.USAGE
    assert main(["conformance", "--command", "no-such-tool {source}"]) == Exit.USAGE
    assert main(["conformance", "--chapter", "nothing"]) == Exit.USAGE
    assert "no chapter `nothing`" in capsys.readouterr().err
