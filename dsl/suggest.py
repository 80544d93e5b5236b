"""The nearest known word to a misspelt one."""

from __future__ import annotations

from collections.abc import Iterable

from dsl.elsewhere import SYNONYMS

_COMPARED = 1000
"""Words that are compared letter by letter: a program may define very many."""


def did_you_mean(word: str, known: Iterable[str]) -> str | None:
    """Help that names the nearest of the known words, or None where none is near.

    Near is a word that differs in case and underscores alone, or by one letter in three (wrong,
    missing, too many, or two exchanged), or that one of both begins with the other; of the nearest
    the first of the alphabet.
    """
    if not 2 <= len(word) <= 60:
        return None
    plain = _plain(word)
    allowed = len(plain) // 3
    names = {name: _plain(name) for name in known}
    alike = sorted(name for name, other in names.items() if abs(len(other) - len(plain)) <= allowed)
    distances = {name: _distance(plain, names[name]) for name in alike[:_COMPARED]}
    nearest = min(distances, key=distances.__getitem__, default=None)
    if nearest is None or distances[nearest] > allowed:
        beginnings = (
            n for n in sorted(names) if _begins(plain, names[n]) or _begins(names[n], plain)
        )
        called = (name for name in SYNONYMS.get(plain, ()) if name in names)
        nearest = next(beginnings, next(called, None))
    return None if nearest is None else f"did you mean `{nearest}`?"


def _begins(beginning: str, word: str) -> bool:
    return len(beginning) >= 3 and word.startswith(beginning)


def _plain(name: str) -> str:
    return name.replace("_", "").casefold()


def _distance(a: str, b: str) -> int:
    """The least number of letters replaced, removed, added, or neighbours exchanged.

    Optimal string alignment: Damerau-Levenshtein without changing a letter twice.
    """
    before: list[int] = []
    row = list(range(len(b) + 1))
    for i, letter in enumerate(a, start=1):
        above, row = row, [i]
        for j, other in enumerate(b, start=1):
            best = min(above[j] + 1, row[-1] + 1, above[j - 1] + (letter != other))
            if i > 1 and j > 1 and letter == b[j - 2] and a[i - 2] == other:
                best = min(best, before[j - 2] + 1)
            row.append(best)
        before = above
    return row[-1]
