"""The catalogue of codes is complete: whatever the packages name is listed, and listed once."""

from __future__ import annotations

import re
from dataclasses import asdict
from pathlib import Path

from dsl.budget import DEFAULT_LIMITS
from dsl.codes import CODES

ROOT = Path(__file__).parent.parent.parent
PHASES = sorted({code.partition("-")[0] for code in CODES})
NAMED = re.compile(rf'"((?:{"|".join(PHASES)})-[a-z]+(?:-[a-z]+)*)"')


def test_every_code_is_used_and_every_used_code_is_listed() -> None:
    named: set[str] = set()
    for package in ("dsl", "compiler", "runtime"):
        for path in (ROOT / package).rglob("*.py"):
            if path.name != "codes.py":
                named.update(NAMED.findall(path.read_text()))
    assert named - set(CODES) == set()
    assert set(CODES) - named == set()


def test_the_reference_lists_the_codes_and_limits() -> None:
    text = (ROOT / "dsl" / "reference" / "codes.md").read_text()
    for name, code in CODES.items():
        assert f"| `{name}` | {code.summary} |\n" in text
    text = (ROOT / "dsl" / "reference" / "limits.md").read_text()
    for name, limit in asdict(DEFAULT_LIMITS).items():
        assert f"| `{name}` | {limit} |" in text


def test_summaries_are_one_line_without_a_full_stop() -> None:
    for code in CODES.values():
        assert "\n" not in code.summary
        assert not code.summary.endswith(".")
        assert code.summary[0].islower()
