"""One evaluation: its state, its driver, and what it may spend.

Evaluation is a walk of the tree without machine recursion. The handler of a node either returns its
value or is a generator that yields the (expression, scope) pairs whose values it needs, or the
generators that `Run.begin` made of them; `Run.drive` runs them on a stack of its own. A fault
travels to the statement around it, is recorded there, and leaves `POISON` behind, which is silent.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import replace
from types import GeneratorType
from typing import Any, TypeVar, cast

import numpy as np

from dsl import ast, scene
from dsl.budget import Limits
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic, Label
from dsl.faults import Exhausted, Fault, Poisoned
from dsl.files import Files
from dsl.lanes import Lanes, Sequential
from dsl.parameters import Settings
from dsl.spans import Source, Span
from dsl.values import Binding, File, Poison, Scope, Value, shown

_Result = TypeVar("_Result")
Steps = Generator["tuple[ast.Expression, Scope] | Task", Value, _Result]
"""What needs the values of expressions to come to a result, or of tasks that have begun."""
Task = Steps[Value]
Handler = Callable[["Run", Any, Scope], "Value | Task"]
Context = Label | tuple[ast.For, tuple[Value, ...]]
"""A call, or a loop's iteration."""

_NodeOfScene = TypeVar("_NodeOfScene", bound=scene.Node)


_LANES_PER_STEP = 8
"""An expression evaluated in so many lanes counts as a step."""
_FAULT_STEPS = 500
"""What a fault costs, in steps: its message and the search for a like name take about as long."""


class Run:
    """The state of one evaluation; `faulty` says that it gives no scene."""

    def __init__(self, files: Files, limits: Limits, handlers: dict[type, Handler]) -> None:
        self.files = files
        self.time = 0.0  # the value of `time`
        self.source: Source | None = None  # of the program itself
        self.settings: Settings = {}  # of its parameters
        self.params: list[scene.Param] = []
        self.advice: list[Diagnostic] = []  # on the names of the program itself
        self.limits = limits
        self.handlers = handlers
        self.diagnostics: list[Diagnostic] = []
        self.faulty = False
        self.sources: dict[str, str] = {}
        self.uses: dict[ast.Name, Binding] = {}
        self.definitions: dict[object, Binding] = {}
        self.alike: dict[ast.Alike, dict[str, Binding]] = {}  # the names in statements of one form
        self.single: dict[ast.Alike, tuple[ast.Statement, ...]] = {}  # those read one by one
        self.loaded: dict[str, File | Poison | None] = {}  # by path; None while being read
        self.context: list[Context] = []  # the calls and loops being evaluated, outermost first
        self.depth = 0
        self.faults = 0
        self.faults_before = 0  # the outermost of the calls that are being evaluated
        self.lanes: Lanes | None = None  # the iterations being evaluated at once
        self.sequential: set[ast.For] = set()  # loops that cannot be
        self._steps = 0
        self._cost = 1
        self._nodes = 0
        self._reported: set[tuple[str, Span]] = set()

    def drive(self, task: Task) -> Value:
        """The value of a task; raises what it does not handle."""
        stack = [task]
        try:
            return self._drive(stack)
        finally:
            while stack:  # what was given up, from the inside
                stack.pop().close()

    def at_once(self, task: Task, lanes: Lanes) -> Value:
        """The value of a task in many iterations; Sequential leaves all as it was."""
        spent, around = (self._steps, self._nodes), len(self.context)
        self.take(lanes)
        try:
            with np.errstate(all="ignore"):
                return self.drive(task)
        except Sequential:
            self._steps, self._nodes = spent
            del self.context[around:]
            raise
        finally:
            self.take(None)

    def take(self, lanes: Lanes | None) -> None:
        """Evaluate in these iterations at once from here on; None: in one.

        A step of n of them counts less than n steps, so no program spends more than it would
        if they were evaluated one after the other.
        """
        self.lanes = lanes
        self._cost = 1 if lanes is None else 1 + lanes.count // _LANES_PER_STEP

    def _drive(self, stack: list[Task]) -> Value:
        value: Any = None
        raised: Fault | Poisoned | None = None
        while True:
            top = stack[-1]
            try:
                if raised is None:
                    due = top.send(value)
                else:
                    fault, raised = raised, None
                    due = top.throw(fault)
            except StopIteration as done:
                stack.pop()
                value = done.value
                if not stack:
                    return cast("Value", value)
                continue
            except (Fault, Poisoned) as fault:
                stack.pop()
                if not stack:
                    raise
                raised, value = fault, None
                continue
            try:
                value = self.begin(*due) if type(due) is tuple else due
            except (Fault, Poisoned) as fault:
                raised, value = fault, None
            if type(value) is GeneratorType:
                stack.append(value)
                value = None

    def begin(self, expression: ast.Expression, scope: Scope) -> Any:
        """The value of an expression, or what comes to it: a generator, which is to be yielded."""
        self._steps += self._cost
        if self._steps > self.limits.steps:
            self.spend(0, expression.span)
        return self.handlers[type(expression)](self, expression, scope)

    def spend(self, steps: int, span: Span) -> None:
        """Count steps beyond the one of each expression: a loop's iterations, a copy's items."""
        self._steps += steps
        if self._steps > self.limits.steps:
            message = f"the program takes more than {self.limits.steps} steps"
            self.exhaust("limit-steps", message, span)

    def record(self, fault: Fault | Poisoned) -> None:
        """Keep a fault, once per code and place, with the calls and loops around it."""
        self.one_by_one()
        self.faulty = True
        self.faults += 1
        if isinstance(fault, Poisoned):
            return
        self.spend(_FAULT_STEPS, fault.span)
        found = fault.diagnostic
        key = (found.code, fault.span)
        if key not in self._reported:
            self._reported.add(key)
            self.report(replace(found, secondary=found.secondary + self._context_labels()))

    def report(self, *diagnostics: Diagnostic) -> None:
        """Keep diagnostics; the run ends when there are too many."""
        self.diagnostics += diagnostics
        self.faulty |= any(found.severity == "error" for found in diagnostics)
        if len(self.diagnostics) > self.limits.diagnostics:
            raise Exhausted

    def exhaust(self, code: str, message: str, span: Span, help: str | None = None) -> None:
        """End the run at a limit."""
        self.one_by_one()
        raise Exhausted(
            diagnostic(code, message, span, help=help, secondary=self._context_labels())
        )

    def one_by_one(self) -> None:
        """What follows cannot be done in many iterations at once."""
        if self.lanes is not None:
            raise Sequential

    def made(self, node: _NodeOfScene, span: Span, edges: int = 1) -> _NodeOfScene:
        """Count a node of the scene graph, a batch by its edges."""
        self._nodes += edges
        if self._nodes > self.limits.nodes:
            self.exhaust("limit-nodes", f"more than {self.limits.nodes} objects", span)
        return node

    def check_length(self, length: int, span: Span) -> None:
        """Count the making of a list, or of a chain of maps, and end the run if it is too long."""
        self.spend(length, span)
        if length > self.limits.list_length:
            message = f"a list of {length} items, more than {self.limits.list_length}"
            self.exhaust("limit-list-length", message, span)

    def _context_labels(self) -> tuple[Label, ...]:
        """The three innermost distinct calls and loops, innermost first."""
        labels: dict[Label, None] = {}
        for entry in reversed(self.context):
            labels[_label(entry)] = None
            if len(labels) == 3:
                break
        return tuple(labels)


def _label(entry: Context) -> Label:
    if isinstance(entry, Label):
        return entry
    node, values = entry
    pairs = zip(node.variables, values, strict=True)
    words = ", ".join(f"{variable.name} = {shown(value)}" for variable, value in pairs)
    first, last = node.variables[0].span, node.variables[-1].span
    return Label(Span(first.source, first.start, last.end), f"with {words}")
