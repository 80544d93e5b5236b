"""`ovolo explain` and `ovolo conformance`: the language reference at work."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest

from dsl.codes import CODES
from dsl.examples import read_examples
from ovolo.__main__ import main
from ovolo.commands.conformance import OURS, ourselves
from ovolo.conformance import Tools, execute, judge
from ovolo.exits import Exit

EXAMPLES = list(read_examples())


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


def test_we_conform_to_our_own_reference() -> None:
    chapters = dict(judge(EXAMPLES, Tools(**OURS), ourselves))
    assert {name: c.failed for name, c in chapters.items() if c.failed} == {}
    assert sum(chapter.passed for chapter in chapters.values()) == len(EXAMPLES)


def test_processes_are_judged_as_we_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent.parent.parent))
    process = {name: f"{sys.executable} -m {command}" for name, command in OURS.items()}
    chosen = [*{(e.kind, e.language, bool(e.words)): e for e in EXAMPLES}.values()]
    chapters = dict(judge(chosen, Tools(**process)))
    assert {name: c.failed for name, c in chapters.items() if c.failed} == {}


def test_without_a_command_we_judge_ourselves(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["conformance", "--chapter", "form"]) == Exit.OK
    out = capsys.readouterr().out
    assert "\x1b[" not in out
    assert out.endswith(" passed, 0 failed, 0 not run\n")


def test_one_that_prints_nothing_conforms_nowhere(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["conformance", "--chapter", "bevels", "--command", "true {source}"]) == 1
    assert "fails: every bevelled shape: line 1 is ``, where `ovolo ir 1` is due" in (
        capsys.readouterr().out
    )


def test_what_a_tool_cannot_do_is_not_run() -> None:
    chosen = [e for e in EXAMPLES if e.words or e.kind in ("formatted", "picture")]
    chapters = dict(judge(chosen, Tools("tool {source}"), ourselves))
    assert sum(chapter.skipped for chapter in chapters.values()) == len(chosen)


def test_a_wrong_answer_is_told_from_the_right_one() -> None:
    good = {e.kind: e for e in EXAMPLES if not e.words}
    for kind, example in good.items():
        edited = example.outcome.replace("1", "2").replace("a", "b")
        ((_, chapter),) = judge([replace(example, outcome=edited)], Tools(**OURS), ourselves)
        assert chapter.failed, kind


@pytest.mark.parametrize(
    ("program", "reason"),
    [
        ("import os; os.abort()", "the tool was ended by SIGABRT"),
        ("import time; time.sleep(9)", "no answer after 2 seconds"),
        # A child that goes on, and keeps what it has inherited open, is not waited for.
        (
            "import subprocess, time; subprocess.Popen(['sleep', '9']); time.sleep(9)",
            "no answer after 2 seconds",
        ),
        ("while True: print('x' * 1_000_000)", "more than 10 MB printed"),
        ("import sys; sys.stdout.buffer.write(bytes(range(256)))", "line 1 is `\x00"),
        ("raise ValueError('oh')", "exit code 1, where 0 is due: `ValueError: oh`"),
    ],
)
def test_a_tool_that_fails_is_told_how(program: str, reason: str, tmp_path: Path) -> None:
    tool = tmp_path / "tool.py"
    tool.write_text(program)
    example = next(e for e in EXAMPLES if e.kind == "ir" and not e.words)
    process = partial(execute, seconds=2.0)
    ((_, chapter),) = judge([example], Tools(f"{sys.executable} {tool} {{source}}"), process)
    assert chapter.failed[example.name].startswith(reason)


def test_one_example_is_run_and_shows_what_the_tool_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tool = tmp_path / "tool.py"
    tool.write_text("import sys; print('half'); print('an idea', file=sys.stderr)")
    words = ["conformance", "--example", "a scale of zero"]
    assert main(words) == Exit.OK
    out = capsys.readouterr().out
    assert out.startswith("chains")
    assert "standard" not in out
    assert main([*words, "--command", f"{sys.executable} {tool} {{source}}"]) == Exit.FAULTS
    out = capsys.readouterr().out
    assert "standard output:\nhalf\nstandard error:\nan idea\n" in out
    assert out.count("fails") == 1
    assert main(["conformance", "--example", "a scale of zebra"]) == Exit.USAGE
    assert "did you mean `a scale of zero`?" in capsys.readouterr().err


def test_the_suite_is_written_as_json(tmp_path: Path) -> None:
    target = tmp_path / "suite.json"
    assert main(["conformance", "--dump", str(target)]) == Exit.OK
    suite = json.loads(target.read_text())
    assert len(suite) == len(EXAMPLES)
    assert {"chapter", "name", "language", "source", "kind", "outcome"} <= set(suite[0])
    for chapter in {example["chapter"] for example in suite}:
        assert main(["conformance", "--chapter", chapter, "--dump", str(target)]) == Exit.OK
        found = json.loads(target.read_text())
        assert found == [example for example in suite if example["chapter"] == chapter]


def test_the_report_is_written_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["conformance", "--chapter", "bevels", "--command", "true {source}", "--json"]
    assert main(words) == Exit.FAULTS
    report = json.loads(capsys.readouterr().out)
    assert report["bevels"]["passed"] == 0
    assert "every bevelled shape" in report["bevels"]["failed"]


def test_a_command_that_cannot_be_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["conformance", "--command", "tool"]) == Exit.USAGE
    assert main(["conformance", "--command", "no-such-tool {source}"]) == Exit.USAGE
    assert main(["conformance", "--chapter", "nothing"]) == Exit.USAGE
    assert "no chapter `nothing`" in capsys.readouterr().err
