"""The syntax tree: what a source says, before it means anything.

Nodes are frozen, compared by identity, and each has the span of its text. Left-recursive constructs
(sums, products, suffix chains, `else if`) are flat sequences, so a tree is never deeper
than the brackets of its source.
"""

from __future__ import annotations

from dsl.alike import Lines
from dsl.records import node
from dsl.spans import Source, Span


@node
class Missing:
    """An expression that could not be read; its fault has been reported."""

    span: Span


@node
class Number:
    """`1.5`; an array of numbers within `Alike`."""

    span: Span
    value: float


@node
class AngleLiteral:
    """`40deg`, `0.5turn`; an array of degrees within `Alike`."""

    span: Span
    degrees: float


@node
class Boolean:
    """`true` or `false`."""

    span: Span
    value: bool


@node
class String:
    """`"text"`, its escapes resolved."""

    span: Span
    text: str


@node
class ColorLiteral:
    """`#d2b48c`, already linear."""

    span: Span
    components: tuple[float, float, float]


@node
class Name:
    """A use of a name."""

    span: Span
    name: str


@node
class VectorLiteral:
    """`(a, b)` up to four components."""

    span: Span
    components: tuple[Expression, ...]


@node
class ListLiteral:
    """`[a, b, …]`."""

    span: Span
    items: tuple[Expression, ...]


@node
class Operator:
    """An operator's word and place."""

    span: Span
    symbol: str


@node
class Unary:
    """`-a` or `not a`."""

    span: Span
    operator: Operator
    operand: Expression


@node
class Operation:
    """Operands joined by operators of one precedence, read from the left.

    `operands` has one more element than `operators`.
    """

    span: Span
    operands: tuple[Expression, ...]
    operators: tuple[Operator, ...]


@node
class Argument:
    """`value` or `name: value`."""

    span: Span
    name: str | None
    name_span: Span | None
    value: Expression


@node
class Call:
    """The suffix `(arguments)`."""

    span: Span
    arguments: tuple[Argument, ...]


@node
class Member:
    """The suffix `.name`; before a `Call`, a suffix call or a call of a file's function."""

    span: Span
    name: str


@node
class Index:
    """The suffix `[index]`."""

    span: Span
    index: Expression


Suffix = Call | Member | Index


@node
class Chain:
    """A base followed by suffixes, applied in reading order."""

    span: Span
    base: Expression
    suffixes: tuple[Suffix, ...]


@node
class Alike:
    """Statements of one form, which differ in their numbers: in `first`, arrays of one for each.

    Only `dsl.parser.read` makes them.
    """

    span: Span
    first: Chain
    lines: Lines


@node
class If:
    """`if c { … } else if d { … } else { … }`."""

    span: Span
    branches: tuple[tuple[Expression, Block], ...]
    otherwise: Block | None


@node
class LoopVariable:
    """`name in range` of a loop's head."""

    span: Span
    name: str
    name_span: Span
    range: Expression


@node
class For:
    """`for i in a..b, j in list { … }`: the last variable runs fastest."""

    span: Span
    variables: tuple[LoopVariable, ...]
    body: Block


@node
class Block:
    """`{ statements }`, or a whole file; one that is not `closed` ends with the file."""

    span: Span
    statements: tuple[Statement, ...]
    closed: bool = True


@node
class Let:
    """`let name = value`; `doc` is the text of the `///` lines above it, here and below."""

    span: Span
    name: str
    name_span: Span
    value: Expression
    doc: str = ""


@node
class Parameter:
    """`name` or `name = default`."""

    span: Span
    name: str
    name_span: Span
    default: Expression | None
    doc: str = ""


@node
class Function:
    """`fn name(parameters) { … }`; `body` is None where it could not be read."""

    span: Span
    name: str
    name_span: Span
    parameters: tuple[Parameter, ...]
    body: Block | None
    doc: str = ""


@node
class Use:
    """`use "path" as name`; `path` is None where it could not be read."""

    span: Span
    path: String | None
    name: str
    name_span: Span
    doc: str = ""


@node
class Param:
    """`param name = default` or `param name = default in allowed`, at the top of a file."""

    span: Span
    name: str
    name_span: Span
    default: Expression
    allowed: Expression | None
    doc: str = ""


Expression = (
    Missing
    | Number
    | AngleLiteral
    | Boolean
    | String
    | ColorLiteral
    | Name
    | VectorLiteral
    | ListLiteral
    | Unary
    | Operation
    | Chain
    | Alike
    | If
    | For
    | Block
)
Definition = Let | Function | Use | Param
Statement = Definition | Expression


@node
class Module:
    """The syntax tree of one file; not `complete` if reading was given up at a limit."""

    source: Source
    body: Block
    complete: bool = True
