"""Branches of a scene (`compiler.compress`) as statements."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from compiler.appearance import Materials
from compiler.compilation import Compilation
from compiler.compress import NO_MATERIAL, Branches, Edge, compress, overriding
from compiler.ir import UP_AXES, SceneIR
from compiler.program import Program, ProgramError, words
from compiler.prototypes import Prototypes
from compiler.provenance import Origins
from compiler.transforms import compose
from compiler.walk import walk
from dsl.builtins import BUILTINS
from dsl.codes import diagnostic
from dsl.diagnostics import Diagnostic
from dsl.format import format_source
from dsl.scene import (
    MATERIAL_FRACTIONS,
    File,
    Material,
    Mesh,
    Node,
    Shape,
    ShapeKind,
    Step,
    StepKind,
)
from dsl.spans import Place, Source
from dsl.tokens import KEYWORDS, RESERVED

MOST = 5_000
"""Instances, as written, and triangles written out, of a program for people."""
FEW = 64
"""Triangles of a mesh that is written out though there is a folder for it."""
MAX_STEPS = 16
"""Steps that an object keeps; a longer chain becomes one matrix."""
DEEPEST = 4
"""Groups within groups that are written in place; what is deeper gets a name."""


def write(scene: Compilation, folder: str | None) -> Program:
    """See `compiler.program.write_program`."""

    def load(file: File) -> tuple[Node | None, list[Diagnostic]]:
        return scene.load(file), []

    walked = walk(scene.graph.root, load)
    prototypes, materials, origins = Prototypes(), Materials(), Origins()
    branches = compress(walked, prototypes.index, materials.index, origins)
    writer = _Writer(branches, prototypes.nodes, materials.nodes, origins, folder)
    body = writer.statements()
    head = _views(scene.ir, writer.unsaid)
    text = "\n".join([*head, "", *writer.definitions, "", *body, ""])
    canonical, faults = format_source(Source(scene.graph.name, text))
    assert canonical is not None, faults
    return Program(canonical, writer.meshes, tuple(writer.unsaid))


@dataclass(slots=True)
class _Writer:
    """Writes definitions as they are needed; `_texts` are the objects written so far."""

    branches: Branches
    leaves: Sequence[Shape | Mesh]
    materials: Sequence[Material]
    origins: Origins
    folder: str | None
    definitions: list[str] = field(default_factory=list)
    meshes: dict[str, Mesh] = field(default_factory=dict)
    unsaid: list[Diagnostic] = field(default_factory=list)
    _names: set[str] = field(default_factory=lambda: {*BUILTINS, *KEYWORDS, *RESERVED})
    _words: list[str] = field(default_factory=list)
    _uses: dict[int, int] = field(default_factory=dict)
    _labels: dict[int, str] = field(default_factory=dict)
    _open: set[int] = field(default_factory=set)  # groups without a word for them
    _bodies: dict[int, list[str]] = field(default_factory=dict)
    _texts: dict[int, str] = field(default_factory=dict)
    _depths: dict[int, int] = field(default_factory=dict)
    _bound: dict[int, str] = field(default_factory=dict)
    _triangles: int = 0

    def statements(self) -> list[str]:
        """The statements of the root; what they name is in `definitions`."""
        self._words = [key[4] for key in self.origins.numbers]
        last = len(self.branches.edges) - 1
        self._count(last)
        for branch in range(last):  # children come first
            if ~branch not in self._uses:
                continue
            lines = list(self._lines(branch))
            if ~branch in self._open:
                self._bodies[~branch] = lines
                self._depths[~branch] = self._depth(branch)
            else:
                self._depths[~branch] = self._depth(branch) + 1
                body = "\n".join(lines)
                self._define(~branch, "{\n" + body + "\n}" if lines else "{}")
        return list(self._lines(last))

    def _count(self, last: int) -> None:
        """How often each target is written."""
        stack, seen, lanes = [last], {last}, 0
        while stack:
            for edge in self.branches.edges[stack.pop()]:
                lanes += edge.count
                self._uses[edge.target] = self._uses.get(edge.target, 0) + edge.count
                label = self._label(edge)
                if label:
                    self._labels.setdefault(edge.target, label)
                elif edge == Edge(edge.target) and edge.target < 0:
                    self._open.add(edge.target)
                if edge.target < 0 and ~edge.target not in seen:
                    seen.add(~edge.target)
                    stack.append(~edge.target)
        self._open = {target for target in self._open if self._uses[target] == 1}
        lanes -= len(self._open)
        if lanes > MOST:
            message = f"{lanes:,} instances, more than {MOST:,}, are no program to read"
            raise ProgramError(message)

    def _depth(self, branch: int) -> int:
        return max((self._depths.get(e.target, 0) for e in self.branches.edges[branch]), default=0)

    def _define(self, target: int, text: str) -> None:
        """Keep the text of an object: under a name if it has one, is used often, or deep."""
        named = target < 0 and target in self._labels
        if named or self._uses[target] > 1 or self._depths.get(target, 0) >= DEEPEST:
            name = self._name(self._hint(target))
            self.definitions.append(f"let {name} = {text}")
            self._depths[target] = 0
            text = name
        self._texts[target] = text

    def _lines(self, branch: int) -> Iterator[str]:
        for edge in self.branches.edges[branch]:
            if edge.target in self._open:
                yield from self._bodies[edge.target]
                continue
            if edge.target >= 0 and edge.target not in self._texts:
                self._define(edge.target, self._leaf(edge.target))
            text = self._texts[edge.target]
            bound = self._material(edge.material)
            for steps in self._placements(edge):
                yield f"{text}{steps}{bound}"

    def _placements(self, edge: Edge) -> Iterator[str]:
        """The suffix calls of each lane; lanes without an inverse draw nothing."""
        if edge.chain < 0:
            yield ""
            return
        steps = _without_detours(self.branches.chains[edge.chain].steps)
        if not steps:
            yield ""
            return
        forward, inverse = np.empty((2, edge.count, 3, 4))
        placement = compose(steps)
        placement.forward.round_into(forward)
        placement.inverse.round_into(inverse)
        exists = (np.isfinite(forward) & np.isfinite(inverse)).all(axis=(1, 2))
        for lane in np.flatnonzero(exists).tolist():
            if len(steps) > MAX_STEPS:
                yield words.matrix(forward[lane])
            else:
                yield "".join(words.step(step, lane) for step in steps)

    def _material(self, code: int) -> str:
        if code == NO_MATERIAL:
            return ""
        number = overriding(code) if code < NO_MATERIAL else code
        if number not in self._bound:
            name = self._name("paint")
            self.definitions.append(f"let {name} = {words.material(self._sayable(number))}")
            self._bound[number] = name
        return f".{'override' if code < NO_MATERIAL else 'material'}({self._bound[number]})"

    def _sayable(self, number: int) -> Material:
        """The material with its numbers within what the language allows."""
        given = self.materials[number]
        changed: dict[str, Any] = {}
        if given.textures:
            self._report("textures are left out: materials have their constants")
            changed["textures"] = ()
        for name in MATERIAL_FRACTIONS:
            changed[name] = min(max(getattr(given, name), 0.0), 1.0)
        for name in ("diffuse", "emission", "specular"):
            changed[name] = tuple(max(c, 0.0) for c in getattr(given, name))
        changed["ior"] = max(given.ior, 1.0)
        material = replace(given, **changed)
        if material != replace(given, textures=()):
            self._report("a material's numbers out of range are brought into it")
        return material

    def _leaf(self, target: int) -> str:
        leaf = self.leaves[target]
        if isinstance(leaf, Shape):
            return words.shape(leaf)
        if leaf.attributes:
            self._report("the normals, colours and coordinates of a mesh are left out")
        if self.folder is not None and len(leaf.triangles) > FEW:
            path = f"{self.folder}/{self._name(self._hint(target))}.obj"
            self.meshes[path] = leaf
            return words.call("mesh", f'"{path}"')
        corners = leaf.points[leaf.triangles].reshape(-1, 9)
        self._triangles += len(corners)
        if self._triangles > MOST:
            message = f"{self._triangles:,} triangles, more than {MOST:,}, are no program to read"
            raise ProgramError(message)
        lines = [
            words.shape(Shape(ShapeKind.TRIANGLE, tuple(map(float, row))))
            for row in corners[_have_area(corners)]
        ]
        return "{\n" + "\n".join(lines) + "\n}"

    def _label(self, edge: Edge) -> str:
        """What the object path calls an edge's target, if anything."""
        numbers = [origin for origin, _ in edge.segments]
        numbers += [edge.batch] if edge.batch >= 0 else []
        return next((self._words[n] for n in reversed(numbers) if self._words[n]), "")

    def _hint(self, target: int) -> str:
        """What to call an object."""
        if target in self._labels or target < 0:
            return self._labels.get(target, "group")
        leaf = self.leaves[target]
        return leaf.kind.value if isinstance(leaf, Shape) else "mesh"

    def _name(self, hint: str) -> str:
        """A name that nothing else has."""
        base = re.sub(r"\W+", "_", hint.rstrip("/").rpartition("/")[2], flags=re.ASCII).strip("_")
        if not base or base[0].isdigit():
            base = f"_{base}"
        name, number = base, 1
        while name in self._names:
            number += 1
            name = f"{base}_{number}"
        self._names.add(name)
        return name

    def _report(self, message: str) -> None:
        said = diagnostic("usd-program", message)
        if said not in self.unsaid:
            self.unsaid.append(said)


def _without_detours(steps: tuple[Step, ...]) -> tuple[Step, ...]:
    """The steps without neighbours that move there and back."""
    kept: list[Step] = []
    for step in steps:
        if (
            kept
            and step.kind is kept[-1].kind is StepKind.TRANSLATE
            and step.inverse == kept[-1].inverse
            and np.array_equal(step.values, -kept[-1].values)
        ):
            kept.pop()
        else:
            kept.append(step)
    return tuple(kept)


def _have_area(corners: np.ndarray) -> np.ndarray:
    """Which triangles `(n, 9)` the language takes: those whose corners are on no line."""
    a, b, c = corners[:, :3], corners[:, 3:6], corners[:, 6:]
    u, v = 0.5 * b - 0.5 * a, 0.5 * c - 0.5 * a
    size = np.maximum(np.abs(u).max(axis=1), np.abs(v).max(axis=1))[:, None]
    with np.errstate(all="ignore"):
        normal = np.cross(u / size, v / size)
    return np.asarray(np.isfinite(normal).all(axis=1) & normal.any(axis=1))


def _views(scene: SceneIR, unsaid: list[Diagnostic]) -> list[str]:
    """Settings, cameras and lights; what the language has no word for is reported."""

    def report(message: str, place: Place | None = None) -> None:
        unsaid.append(diagnostic("usd-program", message, place))

    record = scene.settings[0]
    named = words.settings(record)
    lines = []
    for number, camera in enumerate(scene.cameras):
        name = scene.text(int(camera["name"]))
        aspect = float(camera["aspect"])
        if np.linalg.det(camera["world_from_camera"][:, :3]) < 0.0:
            report(f"camera `{name}` is mirrored, and left out")
            continue
        if any(camera["shift"]):
            report(f"camera `{name}` has a window beside its axis, which is moved to it")
        if camera["exposure"] or camera["lens_radius"]:
            report(f"camera `{name}` has an exposure or a lens of its own, which are left out")
        if not math.isnan(aspect) and number == 0 and not {"width", "height"} & set(named):
            # A picture of the camera's own proportions, as the stage asks for.
            named["width"], named["height"] = "640", words.number(max(1, round(640 / aspect)))
        elif not math.isnan(aspect):
            width, height = float(named.get("width", 640)), float(named.get("height", 480))
            if abs(width / height - aspect) > 0.01 * aspect:
                report(f"camera `{name}` has proportions of its own, and gets the picture's")
        short = re.sub(r'["\\\x00-\x1f]', "_", name.rpartition("/")[2])
        lines.append(words.camera(camera, short))
    up = UP_AXES[int(record["up"])]
    if up != "y" and not lines:
        report(f"{up} is up, which matters where a camera is made up")
    if named:
        lines.insert(0, words.call("settings", **named))
    for number, light in enumerate(scene.lights):
        texture = scene.sky_texture(number)
        if re.search(r'["\\\[\]\x00-\x1f]', texture):
            report(f"the texture `{texture}` of a sky is left out: it has its color alone")
            texture = ""
        lines.append(words.light(light, texture))
    return lines
