"""A grammar in EBNF as a recogniser and as an author: the second opinion about the parser.

Sets of ends for every node and position, so any grammar without left recursion, however ambiguous.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from random import Random

_WORD = re.compile(
    r"""\(\*.*?\*\)|\?\s*(.*?)\s*\?|"([^"]*)"|'([^']*)'|(\w+)|([=;|{}()\[\]])|\s+""", re.S
)
_CLOSERS = {"[": "]", "{": "}", "(": ")"}


@dataclass(eq=False)
class Node:
    """A piece of a grammar.

    `kind` is "text" (a word), "described" (`? … ?`), "rule", "sequence", "choice", "option" or
    "repeat"; `name` is the word, the description or the rule's name.
    """

    kind: str
    name: str = ""
    parts: tuple[Node, ...] = ()


class Grammar:
    """The rules of a text in EBNF by name; `nodes` are all their pieces, each with its rule.

    Names that have no rule are described words: those of the grammar of words in that of syntax.
    """

    def __init__(self, text: str) -> None:
        words = [m for m in _WORD.finditer(text) if m[0].strip() and not m[0].startswith("(*")]
        self._words = words
        self._next = 0
        self.nodes: list[tuple[str, Node]] = []
        self.rules: dict[str, Node] = {}
        while self._next < len(words):
            self._rule = self._take()[0]
            assert self._take()[0] == "="
            assert self._rule not in self.rules
            self.rules[self._rule] = self._choice()
            assert self._take()[0] == ";"
        for _, node in self.nodes:
            if node.kind == "rule" and node.name not in self.rules:
                node.kind = "described"
        self._cost = dict.fromkeys(self.rules, 1000)
        for _ in self.rules:
            self._cost = {name: 1 + self._shortest(rule) for name, rule in self.rules.items()}

    def _take(self) -> re.Match[str]:
        self._next += 1
        return self._words[self._next - 1]

    def _node(self, *arguments: object) -> Node:
        node = Node(*arguments)  # type: ignore[arg-type]
        self.nodes.append((self._rule, node))
        return node

    def _choice(self) -> Node:
        options = [self._sequence()]
        while self._words[self._next][0] == "|":
            self._take()
            options.append(self._sequence())
        return options[0] if len(options) == 1 else self._node("choice", "", tuple(options))

    def _sequence(self) -> Node:
        parts = []
        while (word := self._words[self._next])[0] not in {"|", ";", *_CLOSERS.values()}:
            self._take()
            described, double, single, rule, _ = word.groups()
            if word[0] in _CLOSERS:
                inside = self._choice()
                assert self._take()[0] == _CLOSERS[word[0]]
                kind = {"[": "option", "{": "repeat", "(": ""}[word[0]]
                parts.append(self._node(kind, "", (inside,)) if kind else inside)
            elif rule is not None:
                parts.append(self._node("rule", rule))
            elif described is not None:
                parts.append(self._node("described", described))
            else:
                parts.append(self._node("text", double if double is not None else single))
        return parts[0] if len(parts) == 1 else self._node("sequence", "", tuple(parts))

    def _shortest(self, node: Node) -> int:
        match node.kind:
            case "option" | "repeat":
                return 0
            case "sequence":
                return sum(map(self._shortest, node.parts))
            case "choice":
                return min(map(self._shortest, node.parts))
            case "rule":
                return self._cost[node.name]
        return 1

    def sentence(self, rule: str, random: Random, size: int) -> list[Node]:
        """The texts and described words of what conforms to a rule, about `size` of them."""
        words: list[Node] = []

        def write(node: Node) -> None:
            match node.kind:
                case "text" | "described":
                    words.append(node)
                case "rule":
                    write(self.rules[node.name])
                case "sequence":
                    for part in node.parts:
                        write(part)
                case "choice" if len(words) < size:
                    write(random.choice(node.parts))
                case "choice":
                    write(min(node.parts, key=self._shortest))
                case "option" | "repeat":
                    while len(words) < size and random.random() < 0.4:
                        write(node.parts[0])
                        if node.kind == "option":
                            break

        write(self.rules[rule])
        return words


class Reading:
    """Words read by a grammar; `matches` says whether a described piece is that word."""

    def __init__(
        self, grammar: Grammar, words: Sequence[str], matches: Callable[[str, str], bool]
    ) -> None:
        self.grammar = grammar
        self.words = words
        self.matches = matches
        self._known: dict[tuple[Node, int], frozenset[int]] = {}

    def conforms(self, rule: str) -> bool:
        """Whether all words together are what the rule says."""
        return len(self.words) in self.ends(self.grammar.rules[rule], 0)

    def ends(self, node: Node, start: int) -> frozenset[int]:
        """Where what the node says can end, if it begins at `start`."""
        key = node, start
        if key not in self._known:
            self._known[key] = frozenset(self._ends(node, start))
        return self._known[key]

    def _ends(self, node: Node, start: int) -> set[int]:
        match node.kind:
            case "text" | "described":
                if node.kind == "text" and len(node.name) > 1 and self._letters:
                    end = start + len(node.name)
                    return {end} if "".join(self.words[start:end]) == node.name else set()
                there = start < len(self.words)
                return {start + 1} if there and self._is(node, self.words[start]) else set()
            case "rule":
                return set(self.ends(self.grammar.rules[node.name], start))
            case "choice":
                return set().union(*(self.ends(part, start) for part in node.parts))
            case "option":
                return {start} | self.ends(node.parts[0], start)
            case "sequence":
                ends = {start}
                for part in node.parts:
                    ends = set().union(*(self.ends(part, end) for end in ends))
                return ends
        ends, new = {start}, {start}
        while new:
            new = set().union(*(self.ends(node.parts[0], end) for end in new)) - ends
            ends |= new
        return ends

    @property
    def _letters(self) -> bool:
        return isinstance(self.words, str)

    def _is(self, node: Node, word: str) -> bool:
        return word == node.name if node.kind == "text" else self.matches(node.name, word)

    def used(self, rule: str) -> set[Node]:
        """The pieces of the grammar that one way of reading all words as that rule uses."""
        used: set[Node] = set()
        self._use(self.grammar.rules[rule], 0, len(self.words), used)
        return used

    def _use(self, node: Node, start: int, end: int, used: set[Node]) -> None:
        used.add(node)
        match node.kind:
            case "rule":
                self._use(self.grammar.rules[node.name], start, end, used)
            case "choice":
                self._use(
                    next(p for p in node.parts if end in self.ends(p, start)), start, end, used
                )
            case "option":
                if end != start:
                    self._use(node.parts[0], start, end, used)
            case "sequence":
                self._use_sequence(node.parts, start, end, used)
            case "repeat":
                while start != end:
                    step = next(
                        k for k in sorted(self.ends(node.parts[0], start))
                        if k > start and end in self.ends(node, k)
                    )  # fmt: skip
                    self._use(node.parts[0], start, step, used)
                    start = step

    def _use_sequence(self, parts: tuple[Node, ...], start: int, end: int, used: set[Node]) -> None:
        if not parts:
            return
        reach = [{end}]  # from where each part and those after it can end there
        starts = [{start}]
        for part in parts:
            starts.append(set().union(*(self.ends(part, s) for s in starts[-1])))
        for part, before in zip(reversed(parts), reversed(starts[:-1]), strict=True):
            reach.append({s for s in before if self.ends(part, s) & reach[-1]})
        reach.reverse()
        for part, after in zip(parts, reach[1:], strict=True):
            step = max(self.ends(part, start) & after)
            self._use(part, start, step, used)
            start = step
