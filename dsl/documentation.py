"""Documentation: the `///` lines directly above what they are about."""

from __future__ import annotations

import re

_TRIVIA = re.compile(r"//[^\r\n]*|/\*[\s\S]*?\*/|\r\n?|\n")


def documentation(before: str, begins_line: bool) -> str:
    r"""The text of the last `///` lines of what stands before a word, lines joined by `\n`.

    `before` is nothing but space and comments; `begins_line` says whether it begins with a line.
    An empty line or another comment between the lines and the word separates them. One
    space after `///` is not part of the text; `////` is a plain comment.
    """
    lines: list[str] = []
    fresh, gap = begins_line, 0  # a line has just begun; newlines since the last comment
    for match in _TRIVIA.finditer(before):
        text = match[0]
        if text[0] in "\r\n":
            fresh, gap = True, gap + 1
            if gap > 1:
                lines.clear()
            continue
        if fresh and text.startswith("///") and not text.startswith("////"):
            lines.append(text[3:].removeprefix(" ").rstrip())
        else:
            lines.clear()
        fresh, gap = False, 0
    return "\n".join(lines) if fresh else ""
