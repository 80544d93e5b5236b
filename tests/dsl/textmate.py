"""A small interpreter of TextMate grammars: lines to scopes, as editors do it."""

from __future__ import annotations

import re
import unicodedata
from functools import cache
from typing import Any

Rule = dict[str, Any]


_MARKS = "".join(
    chr(code) for code in range(0x110000) if unicodedata.category(chr(code)) in ("Mn", "Mc", "Me")
)


@cache
def _compiled(pattern: str) -> re.Pattern[str]:
    r"""The pattern as editors read it: their \w has combining marks, Python's has not."""
    inside = re.sub(r"\[[^\]]*\]", lambda found: found[0].replace(r"\w", r"\w" + _MARKS), pattern)
    return re.compile(re.sub(rf"\\w(?!{_MARKS[0]})", lambda _: rf"[\w{_MARKS}]", inside))


def scopes(grammar: Rule, text: str) -> list[str]:
    """The innermost scope of each character; "" where nothing matches."""
    found: list[str] = []
    opened: list[Rule] = []  # rules whose `begin` has been seen and whose `end` has not
    for line in text.splitlines(keepends=True):
        found += _line(grammar, line, opened)
    return found


def _line(grammar: Rule, line: str, opened: list[Rule]) -> list[str]:
    found = [""] * len(line)
    body = line.rstrip("\r\n")
    position = 0
    while True:
        inside = opened[-1] if opened else grammar
        searches: list[tuple[re.Pattern[str], Rule | None]] = []
        if opened:
            searches.append((_compiled(inside["end"]), None))
        rules = _expanded(grammar, inside)
        searches += [(_compiled(rule.get("match") or rule["begin"]), rule) for rule in rules]
        matches = [(m, rule) for p, rule in searches if (m := p.search(body, position))]
        # The earliest counts, and of those the first.
        first = min(matches, key=lambda each: each[0].start(), default=None)
        outer: str = inside.get("name", "") if opened else ""
        start = first[0].start() if first else len(line)
        found[position:start] = [outer] * (start - position)
        if first is None:
            return found
        match, rule = first
        scope: str = outer if rule is None else rule.get("name", outer)
        found[start : match.end()] = [scope] * (match.end() - start)
        if rule is None:
            opened.pop()
        elif "begin" in rule:
            opened.append(rule)
        else:
            assert match.end() > position, "a rule that matches nothing"
            for group, capture in rule.get("captures", {}).items():
                begin, end = match.span(int(group))
                found[begin:end] = [capture["name"]] * (end - begin)
        position = match.end()


def _expanded(grammar: Rule, rule: Rule) -> list[Rule]:
    found: list[Rule] = []
    for inner in rule.get("patterns", ()):
        if "include" in inner:
            named = grammar["repository"][inner["include"].removeprefix("#")]
            if "match" in named or "begin" in named:
                found.append(named)
            else:
                found += _expanded(grammar, named)
        else:
            found.append(inner)
    return found
