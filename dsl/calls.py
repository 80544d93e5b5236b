"""Arguments to parameters: which signature a call means, and what each parameter receives."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from operator import attrgetter
from typing import Any, NamedTuple

from dsl import ast
from dsl.diagnostics import Label
from dsl.elsewhere import BESIDE, FOLLOWING, MIDDLE, PARAMETERS
from dsl.faults import Fault, Poisoned, mismatch, source_text
from dsl.files import Files
from dsl.kinds import ANGLE, COLOR, INTERVAL, VECTOR3
from dsl.lanes import each, varies
from dsl.spans import Span
from dsl.suggest import did_you_mean
from dsl.values import POISON, Builtin, Parameter, Signature, Value, format_number

Form = Callable[[], str]
"""Help that shows how a function is called."""


Arguments = Sequence[ast.Argument]
_NAME = attrgetter("name")


class _Way(NamedTuple):
    """How arguments go to a signature's parameters: each has the place of its argument, or -1.

    `rest` are the places of those beyond the parameters. Without `parameters` one fits nowhere.
    """

    signature: Signature
    parameters: tuple[tuple[Parameter, int], ...] | None
    rest: range


@dataclass(slots=True)
class Site:
    """Where a builtin is called: what its objects and its faults point to.

    `files` are those that it may read; `in_lanes` says that `arguments` may differ between lanes.
    """

    name: str
    span: Span
    files: Files
    arguments: Arguments
    in_lanes: bool
    way: _Way | None = None

    @property
    def expressions(self) -> dict[str, ast.Expression]:
        """The arguments by parameter."""
        parameters = self.way.parameters if self.way is not None else None
        return {
            parameter.name: self.arguments[place].value
            for parameter, place in parameters or ()
            if place >= 0
        }

    @property
    def folder(self) -> str:
        """The folder from which file names start."""
        return self.span.source.folder

    def fault(
        self, code: str, message: str, parameter: str | None = None, help: str | None = None
    ) -> Fault:
        """A fault at the argument for that parameter, or at the whole call."""
        expression = self.expressions.get(parameter or "")
        return Fault(code, message, expression.span if expression else self.span, help=help)


def assign(
    name: str, parameters: tuple[str, ...], arguments: Arguments, form: Form
) -> Sequence[int]:
    """The place of the argument for each parameter, or -1; a fault for one that fits nowhere."""
    places = _places(parameters, tuple(map(_NAME, arguments)), range(0))
    if places is None:
        raise _misfit(name, parameters, arguments, form)
    return places


@lru_cache(maxsize=1024)
def _places(
    parameters: tuple[str, ...], words: tuple[str | None, ...], rest: range
) -> tuple[int, ...] | None:
    """`assign` for arguments with these names, or without; None if one fits nowhere."""
    taken: dict[str, int] = {}
    for place, word in enumerate(words):
        if place in rest:
            continue
        if word is None and place < len(parameters):  # those without a name come first
            word = parameters[place]
        if word is None or word not in parameters or word in taken:
            return None
        taken[word] = place
    return tuple(taken.get(parameter, -1) for parameter in parameters)


def _misfit(name: str, parameters: Sequence[str], arguments: Arguments, form: Form) -> Fault:
    """The fault of the first argument that fits nowhere."""
    positional = [argument for argument in arguments if argument.name is None]
    if len(positional) > len(parameters):
        count = len(parameters)
        return Fault(
            "type-too-many-arguments",
            f"`{name}` takes {count or 'no'} argument{'' if count == 1 else 's'}, "
            f"not {len(positional)}",
            positional[count].span,
            help=form(),
        )
    taken = dict(zip(parameters, positional, strict=False))
    for argument in arguments:
        word, place = argument.name, argument.name_span
        if word is None or place is None:
            continue
        if word not in parameters:
            return Fault(
                "name-unknown-parameter",
                f"`{name}` has no parameter `{word}`",
                place,
                help=_instead_of(word, parameters) or form(),
            )
        if word in taken:
            in_order = ", ".join(f"`{name}`" for name in parameters[: len(positional)])
            return Fault(
                "type-argument-twice",
                f"`{word}` is given twice",
                place,
                help=f"those without a name are {in_order}" if len(positional) > 1 else None,
                secondary=(Label(taken[word].span, "given here already"),),
            )
        taken[word] = argument
    raise AssertionError("an argument that fits nowhere has a fault")


def _instead_of(word: str, parameters: Sequence[str]) -> str | None:
    """Help for a parameter that a function has not, if another may be meant."""
    meant, help = PARAMETERS.get(word, ("", ""))
    near = did_you_mean(word, parameters) or _abbreviated(word, parameters)
    return near or (help if meant in parameters else FOLLOWING.get(word))


def _abbreviated(word: str, parameters: Sequence[str]) -> str | None:
    """Help that names the only parameter that begins with a word."""
    whole = [name for name in parameters if name.startswith(word)]
    return f"did you mean `{whole[0]}`?" if len(whole) == 1 else None


def call_builtin(builtin: Builtin, given: Sequence[Value], site: Site) -> Value:
    """Convert the arguments, of which these are the values, and call.

    Fault if they do not fit, Poisoned if one is faulty.
    """
    for value in given:
        if value is POISON:
            raise Poisoned
    arguments = site.arguments
    site.way = way = _choose(builtin, tuple(map(_NAME, arguments)))
    signature = way.signature
    if way.parameters is None:
        raise _unplaced(builtin, way, arguments)
    values: list[Any] = []
    for parameter, place in way.parameters:
        if place >= 0:
            value = parameter.kind.convert(given[place])
            if value is None:
                argument = arguments[place]
                unfit = _unfit(parameter, argument, given[place])
                if parameter.kind is VECTOR3 and isinstance(given[place], float):
                    _bracketed(unfit, argument, arguments)
                raise _with_form(unfit, builtin) if _may_be_misplaced(builtin, argument) else unfit
            values.append(value)
        elif parameter.required:
            raise Fault(
                "type-missing-argument",
                f"`{builtin.name}` needs `{parameter.name}`",
                site.span,
                help=_forms(builtin),
            )
        else:
            values.append(parameter.default)
    if signature.rest is not None:
        parameter = Parameter(builtin.name, signature.rest)
        rest = ((arguments[place], given[place]) for place in way.rest)
        values.append(tuple(_rest(parameter, rest)))
    if not site.in_lanes or signature.lanes or not any(map(varies, values)):
        result: Value = signature.function(site, *values)
        return result
    return each(partial(signature.function, site), values)  # type: ignore[no-any-return]


def _unplaced(builtin: Builtin, way: _Way, arguments: Arguments) -> Fault:
    """The fault of arguments one of which fits nowhere."""
    names = [parameter.name for parameter in way.signature.parameters]
    arguments = [argument for place, argument in enumerate(arguments) if place not in way.rest]
    together = _together(builtin, names, arguments) if len(builtin.signatures) > 1 else None
    form = partial(_forms, builtin)
    if names[:1] == ["radius"] and isinstance(arguments[0].value, ast.VectorLiteral):
        form = partial(str, MIDDLE)
    return together or _misfit(builtin.name, names, arguments, form)


def _forms(builtin: Builtin) -> str:
    """Help that shows the ways to call a builtin."""
    forms = (_form(builtin.name, signature) for signature in builtin.signatures)
    beside = BESIDE.get(builtin.name)
    return f"it is called as {' or '.join(forms)}{f'; {beside}' if beside else ''}"


def _may_be_misplaced(builtin: Builtin, argument: ast.Argument) -> bool:
    """Whether an argument of the wrong type may have been meant for another parameter."""
    several = len(builtin.signatures[0].parameters) > 1
    return len(builtin.signatures) > 1 or (several and argument.name is None)


def _together(builtin: Builtin, names: Sequence[str], arguments: Arguments) -> Fault | None:
    """The fault of two arguments that belong to two ways of calling a function."""
    labels = {argument.name: argument for argument in arguments}
    for word, argument in labels.items():
        if word is None or word in names:
            continue
        for signature in builtin.signatures:
            others = [parameter.name for parameter in signature.parameters]
            rival = next((n for n in labels if n is not None and n not in others), None)
            if word in others and rival is not None:
                return Fault(
                    "name-unknown-parameter",
                    f"`{builtin.name}` takes `{rival}` or `{word}`, not both",
                    argument.name_span or argument.span,
                    secondary=(Label(labels[rival].span, "given here"),),
                )
    return None


def _rest(parameter: Parameter, given: Iterable[tuple[ast.Argument, Value]]) -> Iterator[Any]:
    """The Python values of arguments beyond the parameters."""
    for argument, found in given:
        value = parameter.kind.convert(found)
        if value is None:
            raise _unfit(parameter, argument, found, "an argument of ")
        yield value


def _unfit(parameter: Parameter, argument: ast.Argument, value: Value, of: str = "") -> Fault:
    """The fault of an argument of another kind."""
    subject = f"{of}`{parameter.name}`"
    return mismatch(subject, parameter.kind.name, value, argument.value)


def _bracketed(fault: Fault, argument: ast.Argument, arguments: Arguments) -> None:
    """Help that writes a vector out: of three numbers, or three times the one that was given."""
    words = [source_text(given.value.span)[:20] for given in arguments if given.name is None]
    if argument.name is not None or len(words) != 3:
        words = 3 * [source_text(argument.value.span)[:20]]
    help = f"a vector has brackets of its own: `({', '.join(words)})`"
    fault.diagnostic = replace(fault.diagnostic, help=help)


def _with_form(fault: Fault, builtin: Builtin) -> Fault:
    """The fault, with the ways to call the builtin for want of other help."""
    if fault.diagnostic.help is None:
        fault.diagnostic = replace(fault.diagnostic, help=_forms(builtin))
    return fault


@lru_cache(maxsize=1024)
def _choose(builtin: Builtin, given: tuple[str | None, ...]) -> _Way:
    """The first signature that arguments with these names, or without, fit; else the nearest."""
    signature = _fitting(builtin, given)
    names = tuple(parameter.name for parameter in signature.parameters)
    rest = range(len(names), given.count(None)) if signature.rest is not None else range(0)
    places = _places(names, given, rest)
    if places is None:
        return _Way(signature, None, rest)
    return _Way(signature, tuple(zip(signature.parameters, places, strict=True)), rest)


def _fitting(builtin: Builtin, given: tuple[str | None, ...]) -> Signature:
    if len(builtin.signatures) == 1:
        return builtin.signatures[0]
    words = {name for name in given if name is not None}
    positional = given.count(None)

    def misfit(signature: Signature) -> tuple[int, int]:
        names = [parameter.name for parameter in signature.parameters]
        surplus = max(0, positional - len(names)) if signature.rest is None else 0
        unknown = len(words.difference(names[positional:])) + surplus
        filled = {*names[:positional], *words}
        lacking = sum(p.required and p.name not in filled for p in signature.parameters)
        return unknown, lacking

    fitting = (s for s in builtin.signatures if misfit(s) == (0, 0))
    return next(fitting, None) or min(builtin.signatures, key=misfit)


def _form(name: str, signature: Signature) -> str:
    words = [shown(parameter) for parameter in signature.parameters]
    if signature.rest is not None:
        words.append("…")
    return f"`{name}({', '.join(words)})`"


def shown(parameter: Parameter) -> str:
    """The parameter as the reference writes it, `name: default`."""
    name, default = parameter.name, parameter.default
    if parameter.required:
        return name
    if isinstance(default, str):
        return f'{name}: "{default}"'
    if isinstance(default, bool):
        return f"{name}: {str(default).lower()}"
    if isinstance(default, tuple):
        numbers = [format_number(component) for component in default]
        if parameter.kind is INTERVAL:
            return f"{name}: {'..'.join(numbers)}"
        return f"{name}: {'rgb' if parameter.kind is COLOR else ''}({', '.join(numbers)})"
    if default is None:
        return f"{name}:"
    return f"{name}: {format_number(default)}{'deg' if parameter.kind is ANGLE else ''}"
