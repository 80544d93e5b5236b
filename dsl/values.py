"""What expressions evaluate to.

A number is a Python float, a truth value a bool, a text a str, a transform `dsl.scene.Transform`, a
material `dsl.scene.Material`, and an object, light, camera or settings a node of the scene graph.
In many iterations at once an array may stand wherever a `float` is named, see `dsl.lanes`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeGuard, get_args

import numpy as np
from numpy.typing import NDArray

from dsl import ast, scene
from dsl.records import node, value
from dsl.scene import IntArray
from dsl.spans import Span


@value
class Angle:
    """An angle in degrees."""

    degrees: float


@value
class Vector:
    """Two, three or four numbers."""

    components: tuple[float, ...]


@value
class Color:
    """Linear Rec. 709 components: red, green, blue."""

    components: tuple[float, float, float]


@value
class Interval:
    """`start..end`, both numbers or both angles."""

    start: float | Angle
    end: float | Angle


@value
class List:
    """Values in order."""

    items: tuple[Value, ...]


@node
class Binding:
    """What a name stands for in one scope: the identity that definition and uses share.

    `span` is the name in its definition. A builtin has its `value` instead.
    """

    name: str
    span: Span | None = None
    value: Value | None = None


EVERY = -1


@dataclass(slots=True, eq=False)
class Scope:
    """The values of one block's bindings, and the scope around it.

    `index` numbers what the statements of a loop's body emit; `EVERY` is each lane's own.
    """

    parent: Scope | None = None
    index: int | None = None
    values: dict[Binding, Value] = field(default_factory=dict)

    def find(self, binding: Binding) -> Value | None:
        """The value, or None if its definition has not been reached."""
        scope: Scope | None = self
        while scope is not None:
            if (value := scope.values.get(binding)) is not None:
                return value
            scope = scope.parent
        return None

    def inside(self) -> Scope:
        """The scope for what an expression contains: what is emitted there has no index."""
        return self if self.index is None else Scope(self)


@node
class Closure:
    """A function of the program with the scope that it was defined in."""

    definition: ast.Function
    scope: Scope


@node
class File:
    """A scene file in use: its top-level names."""

    path: str
    members: dict[str, Value]


@value
class Kind:
    """What a parameter takes.

    `name` with its article, as messages say it; `convert` gives the Python value, or None for a
    value of another kind.
    """

    name: str
    convert: Callable[[Any], Any]


@value
class Parameter:
    """A parameter of a builtin; without a default it must be given.

    `doc` says in a few words what it is, where its name does not.
    """

    name: str
    kind: Kind
    default: Any = None
    required: bool = False
    doc: str = ""


@value
class Signature:
    """One way to call a builtin.

    `function` takes the `dsl.calls.Site` and the converted arguments in order of `parameters`;
    those beyond `parameters`, if `rest` says their kind, come last as a tuple. With `lanes` it
    takes arrays for numbers too, and is evaluated in all lanes at once.
    """

    parameters: tuple[Parameter, ...]
    function: Callable[..., Any]
    rest: Kind | None = None
    lanes: bool = False


@node
class Builtin:
    """A function of the language; the first signature that the arguments fit is called.

    `result` is what it gives, as `type_name` says it, and `doc` a sentence or two: what editors
    show.
    """

    name: str
    signatures: tuple[Signature, ...]
    result: str = ""
    doc: str = ""


@node
class Truths:
    """A truth value in every lane of a loop, see `dsl.lanes`; `values` `(n,)`."""

    values: NDArray[np.bool_]


@node
class Choice:
    """One of several materials in every lane: `options[which[lane]]`."""

    options: tuple[scene.Material, ...]
    which: IntArray


@node
class Part:
    """An object placed once in each of some lanes, which ascend.

    `steps` are batches of `len(lanes)` or hold for all. `origin` is the statement that emits it in
    the loop's body and `numbers` the iterations; there is nothing above them. With `sizes`
    `(len(lanes), 3)` the shape below is one unit of many sizes: scales that come before all steps.
    `inner` are rows of steps before `steps`, the first applied first, each of them composed apart:
    the maps of the items of groups that are placed.
    """

    lanes: IntArray
    child: scene.Node
    steps: tuple[scene.Step, ...] = ()
    origin: scene.Origin | None = None
    numbers: IntArray | None = None
    sizes: scene.FloatArray | None = None
    inner: tuple[tuple[scene.Step, ...], ...] = ()


@node
class Objects:
    """What each of `count` lanes contains: its parts, in their order."""

    parts: tuple[Part, ...]
    count: int


@value
class Poison:
    """The value of what was faulty: whatever touches it is silent, as its fault is reported."""


POISON = Poison()

Value = (
    float
    | bool
    | str
    | Angle
    | Vector
    | Color
    | Interval
    | List
    | Closure
    | Builtin
    | File
    | scene.Transform
    | scene.Material
    | scene.Node
    | Poison
    | scene.FloatArray
    | Truths
    | Choice
    | Objects
)

Object = scene.Shape | scene.Mesh | scene.File | scene.Group | scene.Instances | scene.Bind
"""What can be placed and have a material."""
Placeable = Object | Objects
_NODES = frozenset(get_args(scene.Node))
_PLACEABLE = frozenset((*get_args(Object), Objects))


def is_node(value: Value) -> TypeGuard[scene.Node]:
    """Whether a value is a part of a scene, the same in all lanes."""
    return type(value) in _NODES


def is_placeable(value: Value) -> TypeGuard[Placeable]:
    """Whether a value is an object, in every lane or the same in all."""
    return type(value) in _PLACEABLE


def is_movable(value: Value) -> TypeGuard[scene.Node | Objects]:
    """Whether maps apply to a value: objects, lights and cameras."""
    return (type(value) in _NODES and type(value) is not scene.Settings) or type(value) is Objects


_NAMES: dict[type, str] = {
    float: "a number",
    bool: "a truth value",
    str: "a string",
    Angle: "an angle",
    Color: "a color",
    List: "a list",
    Closure: "a function",
    Builtin: "a function",
    File: "a file",
    scene.Transform: "a transform",
    scene.Material: "a material",
    scene.Sun: "a light",
    scene.PointLight: "a light",
    scene.AreaLight: "a light",
    scene.Sky: "a light",
    scene.Camera: "a camera",
    scene.Settings: "settings",
}


def type_name(value: Value) -> str:
    """The value's type with its article, as messages say it."""
    if isinstance(value, Vector):
        return f"a vector of {len(value.components)}"
    if isinstance(value, Interval):
        return f"an interval of {'angles' if isinstance(value.start, Angle) else 'numbers'}"
    return _NAMES.get(type(value), "an object")


def format_number(value: float) -> str:
    """The shortest text that reads back as the number."""
    return repr(int(value)) if value == int(value) and abs(value) < 1e16 else repr(value)


def shown(value: Value, number: Callable[[float], str] = format_number) -> str:
    """The value as a literal of the language, a color by its linear components; else its type.

    `number` writes its numbers.
    """
    match value:
        case bool():
            return "true" if value else "false"
        case float():
            return number(value)
        case str():
            return f'"{value[:80]}"'
        case Angle(degrees):
            return f"{number(degrees)}deg"
        case Vector(components):
            return f"({', '.join(map(number, components))})"
        case Color(components):
            return f"rgb({', '.join(map(number, components))})"
        case Interval(start, end):
            return f"{shown(start, number)}..{shown(end, number)}"
        case _:
            return type_name(value)
