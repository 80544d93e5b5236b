"""Programs that mean something, grown at random.

Loops over every kind of expression, and lines that differ in their numbers.
"""

from __future__ import annotations

import re
from random import Random

_DIFFERS = re.compile("#")
"""A number of a form."""

NAMES = {
    "size": "param size = 2 in 1..3",
    "clay": "let clay = matte(rgb(0.8, 0.5, 0.4))",
    "gold": "let gold = metal(rgb(1, 0.8, 0.3))",
    "r": "let r = [1, 2, 3]",
    "w": "let w = [0.5, 2, 4]",
    "v": "let v = (1, 2, 3)",
    "k": "let k = 2",
    "leaf": "let leaf = cone().rotate_z(20deg)",
    "kinds": "let kinds = [sphere(), leaf, box(size: (1, 2, 3))]",
    "pair": "let pair = {\nsphere()\nbox().translate(0, 2, 0)\n}",
    "one": "fn one(x) { torus().translate(x, 0, 0) }",
    "two": "fn two(x, y = x * 2) {\ncylinder().scale(1, 1 + abs(y), 1)\npair.translate(0, 0, x)\n}",
    "three": "fn three(x) { if x > 1 { three(x - 1).translate(1, 0, 0) } else { disc() } }",
    "power": "fn power(x, n) { if n <= 0 { 1 } else { x * power(x, n - 1) } }",
    "sum": "fn sum(list, n) { if n < 1 { 0 } else { list[n - 1] + sum(list, n - 1) } }",
}
"""Definitions that a body may use, each after those that it uses itself."""


def _with_names(body: str) -> str:
    """The program of a body and the definitions that it uses."""
    text = body
    for name, definition in reversed(NAMES.items()):
        if re.search(rf"\b{name}\b", text):
            text = f"{definition}\n{text}"
    return text


def program(random: Random) -> str:
    """A program with one loop, of three to eight iterations, over a random body."""
    return _Author(random).program()


def program_of_lines(random: Random) -> str:
    """A program of lines of a few forms, in any order, for `dsl.alike`."""
    return _Author(random).lines()


class _Author:
    def __init__(self, random: Random) -> None:
        self.random = random

    def program(self) -> str:
        ranges = self.one(
            "i in 0..2, j in [1, 3]",
            "i in 0..4",
            "i in [0.5, -1, 7]",
            "i in 0..2, j in 0..2, k in 1..3",
        )
        body = "\n".join(self.statement(2) for _ in range(self.random.randrange(1, 3)))
        loop = f"for {ranges} {{\n{body}\n}}\n"
        return _with_names(loop if "j in" in ranges else f"let j = 3\n{loop}")

    def lines(self) -> str:
        forms = [self.form() for _ in range(self.random.randrange(1, 4))]
        lines = [form for form in forms for _ in range(self.random.randrange(1, 7))]
        if self.random.random() < 0.5:
            self.random.shuffle(lines)
        lines = [_DIFFERS.sub(lambda _: self.literal(), line) for line in lines]
        if self.random.random() < 0.2:
            lines.insert(self.random.randrange(len(lines)), self.statement(1))
        between = self.one("\n", "\n", "\r\n", "\n\n  ", "\n// a comment\n\t", " // é\n")
        body = between.join(lines)
        around = self.one("{}", "{}", "{}", "{{\n{}\n}}", "for a in 0..2 {{\n{}\n}}",
                          "fn all() {{\n{}\n}}\nall()\nall().translate(0, i, 2)")  # fmt: skip
        definitions = "let i = 2\nlet j = 3\n"
        return definitions + _with_names(around.format(body)) + self.one("", "\n")

    def form(self) -> str:
        """An object, some of whose numbers differ from line to line."""
        text = self.object(self.one(*"0011") == "1")
        part = self.one(*"357")
        return re.sub(
            r"(?<![\w.[])(?<!bevel: )(\d+(\.\d+)?|[ij])\b",
            lambda number: "#" if self.random.randrange(10) < int(part) else number[0],
            text,
        )

    def literal(self) -> str:
        return self.one("0", "1", "2", "3", "0.5", "2.25", "12", "1e1", "0.125", "40", "7")

    def one(self, *options: str) -> str:
        return self.random.choice(options)

    def number(self, depth: int) -> str:
        if depth <= 0 or self.random.random() < 0.4:
            return self.one("i", "j", "k", "1", "2.5", "-3", "0.1", "r[1]", "v.y", "size", "time")
        a, b = self.number(depth - 1), self.number(depth - 2)
        match self.random.randrange(18):
            case 0 | 1 | 2 | 3:
                return f"({a} {self.one('+', '-', '*', '/', '%')} {b})"
            case 4:
                return f"(-{a})"
            case 5:
                function = self.one("abs", "floor", "ceil", "round", "sqrt", "exp")
                return f"{function}({a})"
            case 6:
                return f"{self.one('sin', 'cos', 'tan')}({a} * 10deg)"
            case 7:
                return f"{self.one('min', 'max', 'random', 'pow', 'mod')}({a}, {b})"
            case 8:
                return f"w[floor(abs({a})) % 3]"
            case 9:
                return f"({a}, 1, k).{self.one('x', 'y', 'z')}"
            case 10:
                return f"(if {self.condition(depth - 1)} {{ {a} }} else {{ {b} }})"
            case 11:
                return f"[{a}, {b}, 3][{self.one('0', '1', 'floor(abs(j)) % 3')}]"
            case 12:
                return f"power({a}, {self.one('3', 'i', 'floor(abs(i)) % 4')})"
            case 13:
                return f"sum([{a}, {b}, i], {self.one('2', '3', 'j')})"
            case 14:
                return f"clamp({a}, {b}, {b} + 1)"
            case 15:
                return f"mix({a}, {b}, {self.one('0', '0.5', '1', 'i')})"
            case 16:
                return self.one(f"length(({a}, {b}))", "count([i, 2])", "length(v)")
            case _:
                return f"dot(v, ({a}, {b}, i))"

    def condition(self, depth: int) -> str:
        match self.random.randrange(6 if depth > 0 else 4):
            case 4:
                operator = self.one("and", "or")
                return f"({self.condition(depth - 1)}) {operator} ({self.condition(depth - 1)})"
            case 5:
                return f"not ({self.condition(depth - 1)})"
            case 3:
                return self.one("true", "false", "i == j", "v == (i, 2, 3)", "r[0] != i")
            case _:
                operator = self.one("<", "<=", ">", ">=", "==", "!=")
                return f"{self.number(depth - 1)} {operator} {self.number(depth - 1)}"

    def material(self, depth: int) -> str:
        x = self.number(depth)
        return self.one(
            "clay",
            f"matte(rgb(abs({x}) % 1, 0.5, 0.5))",
            f"if {self.condition(1)} {{ clay }} else {{ gold }}",
            f"matte(mix(rgb(1, 0, 0), rgb(0, 0, 1), {x}))",
        )

    def place(self, depth: int) -> str:
        x, y = self.number(depth), self.number(depth)
        return self.one(
            f".translate({x}, {y}, 1)",
            f".translate(({x}, 2, 3))",
            f".translate(v * {x})",
            f".scale(1 + abs({x}))",
            f".scale({x})",
            f".rotate_y({x} * 7deg)",
            f".rotate(axis: (1, 2, abs({x})), angle: {y} * 1deg)",
            f".transform(rotate_x(10deg * {x}) * translate(1, {y}, 0))",
            f".transform(translate({x}, 1, 0).inverse())",
            f".transform(if {self.condition(1)} {{ scale(2) }} else {{ scale({x}) }})",
            f".shear(xy: {x})",
            f".reflect((0, 1, {x}))",
            f".matrix(1, 0, 0, {x}, 0, 1, 0, 0, 0, {y}, 1, 0)",
            f".look_at(from: ({x}, 0, 5), at: (0, {y}, 0))",
            f".material({self.material(depth)})",
            f".override({self.material(depth)})",
        )

    def object(self, depth: int) -> str:
        x = self.number(depth)
        base = self.one(
            *("sphere()", "pair", "leaf", "box(bevel: 0.1)", "one(i)", "two(j)", "three(k)"),
            f"sphere(radius: {x})",
            f"sphere(radius: 1 + abs(floor({x})) % 3)",
            f"box(size: (1, 1 + abs({x}), 2), bevel: 0.1)",
            f"wedge(r: 1..(2 + abs({x})), y: 0..1, phi: 0deg..(40deg + i * 1deg), bevel: 0.01)",
            f"kinds[floor(abs({x})) % 3]",
            f"{self.one('one', 'two', 'three')}({x})",
            f"(if {self.condition(1)} {{ sphere() }} else {{ pair }})",
        )
        return base + "".join(self.place(depth) for _ in range(self.random.randrange(4)))

    def statement(self, depth: int) -> str:
        if depth <= 0 or self.random.random() < 0.3:
            return self.object(2)
        a = self.statement(depth - 1)
        match self.random.randrange(10):
            case 0 | 1:
                return f"if {self.condition(2)} {{\n{a}\n}}"
            case 2:
                return (
                    f"if {self.condition(2)} {{\n{a}\n}} else {{\n{self.statement(depth - 1)}\n}}"
                )
            case 3:
                return f"{{\n{a}\n{self.statement(depth - 1)}\n}}"
            case 4:
                return f"{{\nlet k = {self.number(2)}\n{a}\n}}"
            case 5:
                return f"for k in 0..{self.one('3', 'i', '2')} {{\n{a}\n}}"
            case 6:
                return f"{{\nlet leaf = {self.object(1)}\n{a}\n}}"
            case 7:
                return f"{{\nlet group = {{\n{a}\n{self.object(1)}\n}}\ngroup{self.place(1)}\n}}"
            case 8:
                return f"{{\nfn one(x) {{ {self.object(1)} }}\n{a}\n}}"
            case _:
                light = f"point_light(position: ({self.number(1)}, 0, 0), intensity: 1)"
                return f"{a}\n{self.one(light, 'camera(from: (i, 1, 9))', 'sphere()')}"
