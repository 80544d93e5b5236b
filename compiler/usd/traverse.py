"""One walk over a stage: prims to nodes, with native instances kept as instances.

A *frame* is what is walked at once: the stage, the inside of a native instance, or one prototype
of a point instancer. Equal insides are walked once: the nodes of a frame name prims relative to
its base (the root of the innermost native instance), and say nothing about what is above it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Any

from pxr import Sdf

from compiler.usd.appearance import Appearance, Base, Binding, Display
from compiler.usd.cages import CagesAhead
from compiler.usd.clock import Clock
from compiler.usd.curves import read_curves, read_points
from compiler.usd.draw_modes import draw_stand_in
from compiler.usd.gprims import Gprims
from compiler.usd.instancer import point_batches
from compiler.usd.meshes import Meshes
from compiler.usd.nurbs_curves import read_nurbs_curves
from compiler.usd.options import KNOWN_PURPOSES, PURPOSES, StageOptions
from compiler.usd.patches import read_patch
from compiler.usd.prims import Inherited, PrimTypes
from compiler.usd.primvars import inherits
from compiler.usd.report import Report
from compiler.usd.round import Round
from compiler.usd.sheets import is_singular, pressed
from compiler.usd.skinning import Skinning, is_skinned
from compiler.usd.unused import Unused
from compiler.usd.visits import Visit, visits
from dsl.scene import Bind, Group, Instances, Material, Node, Origin, Step, Transform
from dsl.spans import PrimPlace

NESTING = 100
"""Levels of instances within instances; deeper ones are dropped."""

_ROUND = {
    "BasisCurves": read_curves,
    "HermiteCurves": read_curves,
    "NurbsCurves": read_nurbs_curves,
    "Points": read_points,
}


@dataclass(slots=True)
class Frame:
    """What a walk found.

    `items` are placed by whatever encloses the frame; `hoisted` have reset their transform stack
    and are placed by the enclosing stage or point instance only. `placed` are paths, relative to
    the base, of cameras and lights, which belong to the stage and not to a prototype. `shared`
    is false if a node depends on values above the base.
    """

    base: Base
    items: list[Node] = field(default_factory=list)
    hoisted: list[Node] = field(default_factory=list)
    placed: list[str] = field(default_factory=list)
    shared: bool = True


class Traversal:
    """Walks the stage; one per import."""

    def __init__(
        self,
        stage: Any,
        name: str,
        clock: Clock,
        report: Report,
        options: StageOptions,
        coarser: int,
    ) -> None:
        self.stage = stage
        self.name = name
        self.clock = clock
        self.report = report
        self.appearance = Appearance(clock, report)
        self._options = options
        self._shown = options.purposes or PURPOSES
        self._types = PrimTypes()
        self._instances = bool(stage.GetPrototypes())
        self._unused = Unused(clock, report)
        self._gprims = Gprims(clock, report)
        self._round = Round()
        self._skinning = Skinning(clock, report)
        self._meshes = Meshes(clock, report, self.appearance, options, coarser, self._skinning)
        self._frames: dict[tuple[object, ...], tuple[Frame, Node | None, Node | None]] = {}
        self._open: list[tuple[object, ...]] = []

    def inherited(self, prim: Any) -> Inherited:
        """What a prim passes on, from all its ancestors and itself."""
        result = Inherited()
        for path in prim.GetPath().GetPrefixes():
            each = self.stage.GetPrimAtPath(path)
            authored = self._types.authored(each)
            result = result.passed_on(each, self._types.of(each), authored, self.clock)
        return result

    def origin(self, path: Sdf.Path, frame: Frame, point: bool = False) -> Origin:
        """The origin of an edge that the prim at `path` made."""
        text = str(path)
        return Origin(PrimPlace(self.name, text), frame.base.label(text), point=point)

    def check_passed_on(self) -> None:
        """Report what prims pass on and nothing has read: the last that is asked of the stage."""
        self._unused.check_passed_on(self._meshes.primvars.read)

    def walk(self, root: Any, above: Inherited, base: Base, *, inside: bool = False) -> Frame:
        """Walk the prims at and below `root`, or only those below it (`inside`)."""
        frame = Frame(base)
        found = visits(
            root,
            above,
            self._types,
            self.clock,
            self.report,
            inside=inside,
            instances=self._instances,
        )
        self.appearance.resolve(
            {
                visit.path: visit.prim
                for visit in found
                if visit.inherited.bound
                and visit.inherited.visible
                and (visit.instance or visit.type.imageable)
            },
            previews=self._types.previews,
        )
        drawn = found[1:] if inside else found
        cages = self._meshes.ahead(v for v in drawn if not v.mode and self._is_shown(v))
        for visit in drawn:
            self._draw(visit, frame, cages)
            if visit.own:
                visit.place(self.clock, self.report)
        reset_nodes: list[Node] = []
        # Children come after their parents: backwards, every prim finds its children's nodes.
        for index in range(len(found) - 1, -1, -1):
            visit = found[index]
            items = [*visit.own, *reversed(visit.below)]
            if index == 0 and inside:
                frame.items += items
                break
            if not items:
                continue
            steps, reset = visit.place(self.clock, self.report)
            placed = _placed(items, steps) if steps else items
            if reset and not visit.prim.IsPseudoRoot():
                reset_nodes += reversed(placed)
            elif index == 0:
                frame.items += placed
            else:
                found[visit.above].below += reversed(placed)
        frame.hoisted += reversed(reset_nodes)
        return frame

    def prototype(self, root: Any, above: Inherited, base: Base) -> tuple[Node | None, bool]:
        """One prototype of a point instancer in its own space, and whether it can be shared."""
        # usd-core looks for materials and colours where the prototype stands, not the instancer.
        within = self.inherited(root.GetParent())
        above = replace(
            above,
            bound=within.bound,
            colored=within.colored,
            primvars=within.primvars,
            collections=above.collections or within.collections,
            prototype=True,
        )
        key = ("point", root.GetPath(), above, base)
        entry = self._entry(key, lambda: self.walk(root, above, base), root.GetPath())
        if entry is None:
            return None, True
        frame, node, hoisted = entry
        for path in frame.placed:
            self.report.add(
                "usd-instancer",
                "cameras and lights in point instances are left out",
                path.removeprefix("/") if base.outside else path,
            )
        return _group([item for item in (node, hoisted) if item is not None]), frame.shared

    def _draw(self, visit: Visit, frame: Frame, cages: CagesAhead) -> None:
        """Make the nodes of one prim, in its own space."""
        prim, type, inherited = visit.prim, visit.type, visit.inherited
        if type.kind == "Camera" or type.light:
            if self._options.surroundings:
                frame.placed.append(frame.base.label(str(visit.path)))
            elif not type.gprim:
                return
        if self._is_shown(visit):
            named = self._attributes(visit) if type.mesh and visit.authored.primvars else ()
            self._unused.check(prim, type, visit.authored, named)
        if visit.mode:
            self._draw_stand_in(visit, frame)
            return
        if type.instancer:
            if inherited.visible:
                visit.own += point_batches(self, prim, inherited, frame)
            return
        if self._is_drawn(visit):
            if type.mesh:
                self._draw_mesh(visit, frame, cages)
            elif type.kind in self._gprims:
                self._draw_gprim(visit, frame)
            elif type.kind in _ROUND or type.kind == "NurbsPatch":
                self._draw_smooth(visit, frame)
            elif type.kind not in ("SkelRoot", "Skeleton") and not type.light:
                message = f"`{type.kind}` prims are not drawn"
                self.report.add("usd-unsupported", message, visit.path)
        if visit.instance:
            self._draw_instance(visit, frame)

    def _is_shown(self, visit: Visit) -> bool:
        return visit.inherited.visible and visit.inherited.purpose in self._shown

    def _attributes(self, visit: Visit) -> Collection[str]:
        """The attributes that the materials of a mesh read."""
        binding = self.binding(visit.prim, visit.inherited)
        return self.appearance.attributes(binding, self._subsets(visit))

    def _subsets(self, visit: Visit) -> list[Any]:
        return self.appearance.subsets(visit.prim) if visit.parent else []

    def _is_drawn(self, visit: Visit) -> bool:
        type, inherited = visit.type, visit.inherited
        if type.kind and not type.known:
            message = f"prims of the unknown type `{type.kind}` are not drawn, only those below"
            self.report.add("usd-unsupported", message, visit.path)
            return False
        if not inherited.visible or not type.boundable:
            return False
        if inherited.purpose not in KNOWN_PURPOSES:
            message = f"prims of the unknown purpose `{inherited.purpose}` are not drawn"
            self.report.add("usd-attribute", message, visit.path)
        return inherited.purpose in self._shown

    def _is_skinned(self, visit: Visit, frame: Frame) -> bool:
        """Whether joints move a prim; animations are those of the instance around it."""
        skinned = is_skinned(visit.prim, visit.authored, visit.inherited.skeletal)
        if skinned and visit.proxy:
            frame.shared = False
        return skinned

    def _pose(self, visit: Visit, frame: Frame) -> tuple[Step, ...]:
        return self._skinning.steps(visit.prim) if self._is_skinned(visit, frame) else ()

    def _varies(self, visit: Visit, frame: Frame, *names: str) -> bool:
        """Whether a prim inherits a primvar of these names from the instance around it, or above.

        Other instances may have another, so what is drawn then is not shared with them.
        """
        varies = visit.proxy and visit.inherited.primvars
        varies = varies and inherits(visit.prim, names, frame.base)
        frame.shared = frame.shared and not varies
        return varies

    def _draw_stand_in(self, visit: Visit, frame: Frame) -> None:
        if self._is_shown(visit):
            node = draw_stand_in(visit.prim, visit.mode, self._shown, self.clock, self.report)
            if node is not None:
                origin = self.origin(visit.path, frame)
                visit.own.append(Instances(node, Transform(), origin=origin))

    def _draw_gprim(self, visit: Visit, frame: Frame) -> None:
        placed = self._gprims.read(visit.type.kind, visit.prim)
        if placed is None:
            return
        shape, steps = placed
        child = bound(shape, self.material(visit.prim, visit.inherited, frame))
        origin = self.origin(visit.path, frame)
        steps += self._pose(visit, frame)
        visit.own.append(Instances(child, Transform(steps), origin=origin))

    def _draw_mesh(self, visit: Visit, frame: Frame, cages: CagesAhead) -> None:
        prim = visit.prim
        binding = self.binding(prim, visit.inherited)
        display = self._display(prim, visit.inherited, frame) if binding is None else None
        skinned = self._is_skinned(visit, frame)
        names = self._attributes(visit) if visit.inherited.primvars else ()
        origin = self.origin(visit.path, frame)
        for mesh, material in self._meshes.parts(
            visit,
            self._subsets(visit),
            binding,
            display,
            frame.base,
            cages,
            skinned=skinned,
            varied=self._varies(visit, frame, *names),
        ):
            visit.own.append(Instances(bound(mesh, material), Transform(), origin=origin))

    def _draw_smooth(self, visit: Visit, frame: Frame) -> None:
        """Draw curves, points or a patch."""
        read = _ROUND.get(visit.type.kind)
        if read is None:
            node: Node | None = read_patch(
                visit.prim, self._options.complexity, self.clock, self.report
            )
        else:
            node = _group(read(visit.prim, self._round, self.clock, self.report))
        if node is not None:
            self._varies(visit, frame, "widths")
            child = bound(node, self.material(visit.prim, visit.inherited, frame))
            posed = Transform(self._pose(visit, frame))
            visit.own.append(Instances(child, posed, origin=self.origin(visit.path, frame)))

    def binding(self, prim: Any, inherited: Inherited) -> Binding | None:
        """The binding of a prim that passes on `inherited`."""
        return self.appearance.binding(prim) if inherited.bound else None

    def material(self, prim: Any, inherited: Inherited, frame: Frame) -> Material | None:
        """The material that belongs to the frame; None where it comes from above, or nowhere."""
        binding = self.binding(prim, inherited)
        if binding is not None:
            return frame.base.own(binding)
        display = self._display(prim, inherited, frame)
        return None if display is None else display.material()

    def _display(self, prim: Any, inherited: Inherited, frame: Frame) -> Display | None:
        """How an unbound prim is drawn; None where that comes from above the frame, or nowhere."""
        if not inherited.colored and not inherited.bound:
            return None
        display = self.appearance.display(
            prim, frame.base, colored=inherited.colored, bound=inherited.bound
        )
        if display is None or not display.below:
            return None
        frame.shared = frame.shared and not display.above
        return display

    def _draw_instance(self, visit: Visit, frame: Frame) -> None:
        prim, inherited, path = visit.prim, visit.inherited, visit.path
        binding = self.binding(prim, inherited)
        key = (
            "native",
            prim.GetPrototype().GetPath(),
            inherited,
            visit.model,
            (binding is not None, self.appearance.is_strong(self.stage, binding)),
            path if inherited.collections else None,
        )
        base = Base(path, binding)
        entry = self._entry(key, lambda: self.walk(prim, inherited, base, inside=True), path)
        if entry is None:
            return
        inner, node, hoisted = entry
        frame.shared = frame.shared and inner.shared
        if inner.placed:
            label = frame.base.label(str(path))
            frame.placed += [label + relative for relative in inner.placed]
        material = self.material(prim, inherited, frame)
        origin = self.origin(path, frame)
        if node is not None:
            visit.own.append(Instances(bound(node, material), Transform(), origin=origin))
        if hoisted is not None:
            frame.hoisted.append(Instances(bound(hoisted, material), Transform(), origin=origin))

    def _entry(
        self, key: tuple[object, ...], walk: Any, path: Sdf.Path
    ) -> tuple[Frame, Node | None, Node | None] | None:
        """The frame of that key with its nodes, walked at most once; None within itself."""
        known = self._frames.get(key)
        if known is not None:
            return known
        if key in self._open:
            self.report.add("usd-instancer", "a prototype that contains itself is left out", path)
            return None
        if len(self._open) >= NESTING:
            message = f"instances nested more than {NESTING} levels deep are left out"
            self.report.add("usd-instancer", message, path)
            return None
        self._open.append(key)
        try:
            frame = walk()
        finally:
            self._open.pop()
        entry = (frame, _group(frame.items), _group(frame.hoisted))
        if frame.shared:
            self._frames[key] = entry
        return entry


def bound(node: Node, material: Material | None) -> Node:
    """Bind a material, if there is one."""
    return node if material is None else Bind(node, material)


def _group(items: list[Node]) -> Node | None:
    if len(items) <= 1:
        return items[0] if items else None
    return Group(tuple(items))


def _placed(items: list[Node], steps: tuple[Step, ...]) -> list[Node]:
    """Items under one transform; a single edge takes the steps into its own chain."""
    if len(items) == 1 and isinstance(items[0], Instances):
        only = items[0]
        chain = Transform(only.transform.steps + steps)
        placed = Instances(only.child, chain, only.indices, only.origin)
    else:
        placed = Instances(Group(tuple(items)), Transform(steps))
    flat = pressed(placed) if is_singular(steps) else None
    return [placed if flat is None else flat]
