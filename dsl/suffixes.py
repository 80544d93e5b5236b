"""What follows a value: members, items and suffix calls."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dsl import ast, scene
from dsl.batches import bound
from dsl.builtins import BUILTINS
from dsl.calls import Site, call_builtin
from dsl.elsewhere import MEMBERS
from dsl.faults import Fault, Poisoned, mismatch
from dsl.lanes import Sequential, chosen
from dsl.materials import BIND, OVERRIDE
from dsl.scene import FloatArray
from dsl.suggest import did_you_mean
from dsl.transforms import PLACE
from dsl.values import (
    POISON,
    Builtin,
    Choice,
    Closure,
    Color,
    File,
    Interval,
    List,
    Object,
    Objects,
    Value,
    Vector,
    format_number,
    is_movable,
    is_placeable,
    type_name,
)


def field(value: Value, member: ast.Member) -> Value:
    """`value.name`."""
    match value, member.name:
        case Vector(components), ("x" | "y" | "z" | "w") as letter:
            if (position := "xyzw".index(letter)) < len(components):
                return components[position]
        case Color(components), ("r" | "g" | "b") as letter:
            return components["rgb".index(letter)]
        case Interval(), "start":
            return value.start
        case Interval(), "end":
            return value.end
    raise _no_member(value, member)


def file_member(file: File, member: ast.Member) -> Value:
    """A top-level name of a file."""
    value = file.members.get(member.name)
    if value is None:
        raise Fault(
            "name-unknown-member",
            f"`{file.path}` defines no `{member.name}`",
            member.span,
            help=did_you_mean(member.name, file.members),
        )
    return value


def item(value: Value, index: Value, suffix: ast.Index) -> Value:
    """`value[index]`, counted from 0."""
    if index is POISON:
        raise Poisoned
    if not isinstance(value, List | Vector):
        raise Fault(
            "type-mismatch",
            f"{type_name(value)} has no items",
            suffix.span,
            help="lists and vectors can be indexed",
        )
    if isinstance(index, np.ndarray):
        return _items(value, index)
    if not isinstance(index, float):
        raise mismatch("an index", "a number", index, suffix.index)
    if index != int(index):
        raise Fault(
            "value-not-an-integer",
            f"an index is a whole number, not {format_number(index)}",
            suffix.index.span,
            help="round it with `floor`, `ceil` or `round`",
        )
    items: Sequence[Value] = value.items if isinstance(value, List) else value.components
    if not 0 <= index < len(items):
        last = f"they go from 0 to {len(items) - 1}" if items else "it is empty"
        raise Fault(
            "value-index",
            f"no item {format_number(index)} in {type_name(value)} of {len(items)}; {last}"
            if isinstance(value, List)
            else f"no component {format_number(index)} in {type_name(value)}; {last}",
            suffix.index.span,
            help="the last is `list[count(list) - 1]`" if index < 0.0 and items else None,
        )
    return items[int(index)]


def _items(value: List | Vector, index: FloatArray) -> Value:
    items: Sequence[Value] = value.items if isinstance(value, List) else value.components
    if not ((index >= 0) & (index < len(items)) & (index == np.floor(index))).all():
        raise Sequential
    result: Value = chosen(items, index.astype(np.int64))
    return result


def suffix_call(value: Value, member: ast.Member, given: Sequence[Value], site: Site) -> Value:
    """`value.name(arguments)` for all that does not place an object."""
    if isinstance(value, scene.Transform) and member.name == "inverse":
        if given:
            first = site.arguments[0].span
            raise Fault("type-too-many-arguments", "`inverse` takes no arguments", first)
        return value.inverted()
    builtin = {"material": BIND, "override": OVERRIDE}.get(member.name)
    if builtin is not None and is_placeable(value):
        material = call_builtin(builtin, given, site)
        if isinstance(value, Objects) or isinstance(material, Choice):
            return bound(value, material, member.name == "override", site.span)
        assert isinstance(material, scene.Material)
        origin = scene.Origin(site.span)
        return scene.Bind(value, material, member.name == "override", origin)
    raise _no_member(value, member)


def _called(function: Builtin | Closure) -> str:
    return function.name if isinstance(function, Builtin) else function.definition.name


def _no_member(value: Value, member: ast.Member) -> Fault:
    """The fault of a member or suffix call that the value does not have."""
    name = member.name
    known: tuple[str, ...] = ()
    match value:
        case Vector(components):
            known = tuple("xyzw"[: len(components)])
        case Color():
            known = ("r", "g", "b")
        case Interval():
            known = ("start", "end")
        case scene.Transform():
            known = ("inverse",)
        case _ if isinstance(value, Object):
            known = (*PLACE, "material", "override")
        case _ if is_movable(value):
            known = tuple(PLACE)
    if isinstance(value, Builtin | Closure) and name in (*PLACE, "material", "override"):
        help: str | None = f"call it first: `{_called(value)}().{name}(…)`"
    elif name in known:
        help = f"it is a call: `.{name}(…)`"
    elif isinstance(value, scene.Transform) and name in PLACE:
        help = f"combine transforms by a product: `{name}(…) * t` applies `t` first"
    else:
        help = did_you_mean(name, known)
        if name in ("material", "override"):
            help = "only objects have a material"
        elif isinstance(value, Vector) and len(name) > 1 and set(name) <= set("xyzw"):
            help = "components stand one by one: `(v.x, v.y)`"
        elif elsewhere := MEMBERS.get(type_name(value), {}).get(name):
            help = elsewhere
        elif help is None and isinstance(value, Builtin | Closure):
            help = f"a function is called: `{_called(value)}(…)`"
        elif help is None and name in BUILTINS and name not in PLACE:
            help = f"`{name}` is a function: write `{name}(…)` around the value"
        elif help is None and known:
            help = f"it has {', '.join(f'`{word}`' for word in known)}"
    return Fault(
        "name-unknown-member", f"{type_name(value)} has no `{name}`", member.span, help=help
    )
