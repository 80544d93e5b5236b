"""The prims that a walk comes by, in order, with what each passes on."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from pxr import Sdf, Usd

from compiler.usd.clock import Clock
from compiler.usd.draw_modes import stand_in
from compiler.usd.prims import Authored, Inherited, PrimType, PrimTypes
from compiler.usd.report import Report
from compiler.usd.xform import local_steps
from dsl.scene import Node, Step

LEVELS = 1000
"""Levels of prims; usd-core takes the square of their number to find bindings."""

_DRAWN = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)
_PROTOTYPE = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsLoaded)
"""Prototypes of point instancers may be classes or overs, which are not drawn in place."""


@dataclass(slots=True)
class Visit:
    """A prim on the way: `below` collects the nodes of its children, last child first.

    `mode` is the draw mode that shows it and those below it by something else. A `proxy` is a prim
    of a native instance; a `parent` may have children, whether they are visited or not; only
    children of a `model` can be models. `placed` is what `place` has found.
    """

    prim: Any
    path: Sdf.Path
    type: PrimType
    authored: Authored
    above: int
    inherited: Inherited
    instance: bool
    proxy: bool
    model: bool
    mode: str
    parent: bool
    own: list[Node] = field(default_factory=list)
    below: list[Node] = field(default_factory=list)
    placed: tuple[tuple[Step, ...], bool] | None = None
    _properties: list[Any] | None = None

    def attribute(self, name: str) -> Any | None:
        """The attribute of a name that the prim authors; None if it authors no such attribute.

        usd-core gives all properties of a prim in the time of two.
        """
        place = self.authored.places.get(name)
        if place is None:
            return None
        if self._properties is None:
            self._properties = self.prim.GetAuthoredProperties()
        found = self._properties[place]
        return found if isinstance(found, Usd.Attribute) else None

    def place(self, clock: Clock, report: Report) -> tuple[tuple[Step, ...], bool]:
        """The steps of the prim's own transform, and whether it resets those of its parents.

        Read once; after that the prim's properties are not kept.
        """
        if self.placed is None:
            self.placed = (), False
            if self.type.xformable and "xformOpOrder" in self.authored:
                self.placed = local_steps(self.prim, clock, report, self.attribute)
            self._properties = None
        return self.placed


def visits(
    root: Any,
    above: Inherited,
    types: PrimTypes,
    clock: Clock,
    report: Report,
    *,
    inside: bool,
    instances: bool,
) -> list[Visit]:
    """Visit the prims at and below `root`, which is not drawn itself if it is the `inside` of it.

    What is inside of other instances, instancers and stand-ins is left to whoever draws them.
    Without `instances` the stage has no native ones.
    """
    found: list[Visit] = []
    ancestors: list[int] = []
    depth = root.GetPath().pathElementCount
    proxy = inside or root.IsInstanceProxy()
    prims = iter(Usd.PrimRange(root, _PROTOTYPE if above.prototype else _DRAWN))
    for prim in prims:
        path = prim.GetPath()
        level = path.pathElementCount - depth
        if level >= LEVELS:
            message = f"prims nested more than {LEVELS} levels deep are left out"
            report.add("usd-unsupported", message, path)
            prims.PruneChildren()
            continue
        type, authored = types.of(prim), types.authored(prim)
        del ancestors[level:]
        at_base = inside and not found
        passed, model = above, True
        if ancestors:
            parent = found[ancestors[-1]]
            parent.parent = True
            passed, model = parent.inherited, parent.model
        inherited = passed if at_base else passed.passed_on(prim, type, authored, clock)
        model = model and prim.IsModel()
        mode = stand_in(prim) if model and not at_base else ""
        instance = instances and prim.IsInstance()
        found.append(
            Visit(
                prim,
                path,
                type,
                authored,
                ancestors[-1] if ancestors else -1,
                inherited,
                instance,
                proxy,
                model,
                mode,
                parent=instance or bool(mode) or level == LEVELS - 1,
            )
        )
        ancestors.append(len(found) - 1)
        if mode or (not at_base and (instance or type.instancer)):
            prims.PruneChildren()
    return found
