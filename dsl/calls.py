"""Arguments to parameters: which signature a call means, and what each parameter receives."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from typing import Any, NamedTuple

from dsl import ast
from dsl.diagnostics import Label
from dsl.faults import Fault, Poisoned, mismatch, source_text
from dsl.files import Files
from dsl.kinds import ANGLE, COLOR, INTERVAL, VECTOR3
from dsl.lanes import each, varies
from dsl.spans import Span
from dsl.suggest import did_you_mean
from dsl.values import POISON, Builtin, Parameter, Signature, Value, format_number

Form = Callable[[], str]
"""Help that shows how a function is called."""


class Given(NamedTuple):
    """An argument and its value."""

    argument: ast.Argument
    value: Value


@dataclass(slots=True)
class Site:
    """Where a builtin is called: what its objects and its faults point to.

    `files` are those that it may read; `expressions` are the arguments by parameter.
    """

    name: str
    span: Span
    files: Files
    expressions: dict[str, ast.Expression] = field(default_factory=dict)

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
    name: str, parameters: Sequence[str], given: Sequence[Given], form: Form
) -> dict[str, Given]:
    """The argument for each parameter that has one; faults for those that fit nowhere."""
    named = bool(given) and given[-1].argument.name is not None  # those without a name come first
    if len(given) <= len(parameters) and not named:
        return dict(zip(parameters, given, strict=False))
    taken: dict[str, Given] = {}
    positional = [item for item in given if item.argument.name is None]
    if len(positional) > len(parameters):
        count = len(parameters)
        raise Fault(
            "type-too-many-arguments",
            f"`{name}` takes {count or 'no'} argument{'' if count == 1 else 's'}, "
            f"not {len(positional)}",
            positional[count].argument.span,
            help=form(),
        )
    taken.update(zip(parameters, positional, strict=False))
    for item in given:
        word, place = item.argument.name, item.argument.name_span
        if word is None or place is None:
            continue
        if word not in parameters:
            raise Fault(
                "name-unknown-parameter",
                f"`{name}` has no parameter `{word}`",
                place,
                help=did_you_mean(word, parameters) or _abbreviated(word, parameters) or form(),
            )
        if word in taken:
            raise Fault(
                "type-argument-twice",
                f"`{word}` is given twice",
                place,
                secondary=(Label(taken[word].argument.span, "given here already"),),
            )
        taken[word] = item
    return taken


def _abbreviated(word: str, parameters: Sequence[str]) -> str | None:
    """Help that names the only parameter that begins with a word."""
    whole = [name for name in parameters if name.startswith(word)]
    return f"did you mean `{whole[0]}`?" if len(whole) == 1 else None


def call_builtin(builtin: Builtin, given: Sequence[Given], site: Site) -> Value:
    """Convert the arguments and call; Fault if they do not fit, Poisoned if one is faulty."""
    words = []
    for item in given:
        if item.value is POISON:
            raise Poisoned
        words.append(item.argument.name)
    signature, names = _choose(builtin, tuple(words))
    rest: list[Given] = []
    if signature.rest is not None:
        count = sum(item.argument.name is None for item in given)
        rest = [*given[len(names) : count]]  # arguments without a name come first
        given = [*given[: len(names)], *given[max(count, len(names)) :]]

    def form() -> str:
        forms = (_form(builtin.name, each) for each in builtin.signatures)
        return f"it is called as {' or '.join(forms)}"

    if len(builtin.signatures) > 1:
        _check_together(builtin, names, given)
    taken = assign(builtin.name, names, given, form)
    values: list[Any] = []
    for parameter in signature.parameters:
        if (found := taken.get(parameter.name)) is not None:
            site.expressions[parameter.name] = found.argument.value
            value = parameter.kind.convert(found.value)
            if value is None:
                help = form if _may_be_misplaced(builtin, found) else None
                raise _unfit(parameter, found, help)
            values.append(value)
        elif parameter.required:
            raise Fault(
                "type-missing-argument",
                f"`{builtin.name}` needs `{parameter.name}`",
                site.span,
                help=form(),
            )
        else:
            values.append(parameter.default)
    if signature.rest is not None:
        values.append(tuple(_rest(Parameter(builtin.name, signature.rest), rest)))
    if signature.lanes or not any(map(varies, values)):
        result: Value = signature.function(site, *values)
        return result
    return each(partial(signature.function, site), values)  # type: ignore[no-any-return]


def _may_be_misplaced(builtin: Builtin, item: Given) -> bool:
    """Whether an argument of the wrong type may have been meant for another parameter."""
    several = len(builtin.signatures[0].parameters) > 1
    return len(builtin.signatures) > 1 or (several and item.argument.name is None)


def _check_together(builtin: Builtin, names: Sequence[str], given: Sequence[Given]) -> None:
    """A fault for two arguments that belong to two ways of calling a function."""
    labels = {item.argument.name: item.argument for item in given}
    for word, argument in labels.items():
        if word is None or word in names:
            continue
        for signature in builtin.signatures:
            others = [parameter.name for parameter in signature.parameters]
            rival = next((n for n in labels if n is not None and n not in others), None)
            if word in others and rival is not None:
                raise Fault(
                    "name-unknown-parameter",
                    f"`{builtin.name}` takes `{rival}` or `{word}`, not both",
                    argument.name_span or argument.span,
                    secondary=(Label(labels[rival].span, "given here"),),
                )


def _rest(parameter: Parameter, given: Sequence[Given]) -> Iterator[Any]:
    """The Python values of arguments beyond the parameters."""
    for item in given:
        value = parameter.kind.convert(item.value)
        if value is None:
            raise _unfit(parameter, item, None, "an argument of ")
        yield value


def _unfit(parameter: Parameter, item: Given, form: Form | None, of: str = "") -> Fault:
    """The fault of an argument of another kind; `form` helps where there are more ways to call."""
    subject = f"{of}`{parameter.name}`"
    fault = mismatch(subject, parameter.kind.name, item.value, item.argument.value)
    if parameter.kind is VECTOR3 and isinstance(item.value, float) and item.argument.name:
        word = source_text(item.argument.value.span)[:20]
        help = f"a vector has brackets of its own: `({word}, {word}, {word})`"
        fault.diagnostic = replace(fault.diagnostic, help=help)
    if fault.diagnostic.help is None and form is not None:
        fault.diagnostic = replace(fault.diagnostic, help=form())
    return fault


@lru_cache(maxsize=1024)
def _choose(builtin: Builtin, given: tuple[str | None, ...]) -> tuple[Signature, list[str]]:
    """The first signature that arguments with these names, or without, fit; else the nearest.

    With it the names of its parameters.
    """
    signature = _fitting(builtin, given)
    return signature, [parameter.name for parameter in signature.parameters]


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
