"""The chapter of all signatures is what the language has."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest

from dsl.builtins import BUILTINS
from dsl.calls import shown
from dsl.examples import REFERENCE
from dsl.materials import BIND, OVERRIDE
from dsl.transforms import PLACE
from dsl.values import Builtin, Parameter

CHAPTER = REFERENCE / "signatures.md"
TABLE = re.compile(r"^\| function \|.*?\n(?=\n)", re.MULTILINE | re.DOTALL)


def cells(parameter: Parameter) -> str:
    kind = parameter.kind.name.split(" ", 1)[1]
    if parameter.required or parameter.default is None:
        return f"`{parameter.name}` {kind}{'' if parameter.required else ', or left out'}"
    return f"`{shown(parameter)}` {kind}"


def rows() -> Iterator[str]:
    functions = [(name, binding.value) for name, binding in BUILTINS.items()]
    suffixes = [(f"object.{each.name}", each) for each in (PLACE["transform"], BIND, OVERRIDE)]
    for name, function in [*functions, *suffixes]:
        if not isinstance(function, Builtin):
            continue
        for signature in function.signatures:
            parameters = [cells(parameter) for parameter in signature.parameters]
            if signature.rest is not None:
                parameters.append(f"… {signature.rest.name.split(' ', 1)[1]}")
            yield f"| `{name}` | {'; '.join(parameters)} | {function.result} |\n"


def test_the_table_has_every_function(request: pytest.FixtureRequest) -> None:
    table = "".join(("| function | parameters | gives |\n|---|---|---|\n", *rows()))
    text = CHAPTER.read_text(encoding="utf-8")
    if request.config.getoption("--update"):
        CHAPTER.write_text(TABLE.sub(lambda _: table, text, count=1), encoding="utf-8")
    else:
        assert table in text
