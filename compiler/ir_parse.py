"""The text form of an IR → SceneIR (see `compiler.ir_text` for the form)."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from compiler import ir
from compiler.appearance import material_table
from compiler.compress import NO_MATERIAL, overriding
from compiler.inverses import derived_inverses
from compiler.ir import KINDS, MESH, SceneIR
from compiler.ir_lines import Line, LineFault, lines
from compiler.ir_text import (
    CAMERA_WORDS,
    IDENTITY_ROWS,
    LIGHT_WORDS,
    MATERIAL_WORDS,
    PROJECTIONS,
    SETTINGS_WORDS,
    SKY_AXES,
    TEXTURE_WORDS,
    Word,
)
from compiler.provenance import Texts
from compiler.rows import needs_default_material
from compiler.validate import validate
from dsl.codes import diagnostic
from dsl.diagnostics import CompileError, Diagnostic
from dsl.scene import DEFAULT_MATERIAL, SHAPE_PARAMETERS, ShapeKind
from dsl.spans import Source

MAX_FAULTS = 20


def parse_ir(text: str, name: str = "scene.ir") -> SceneIR:
    """The scene that `text` describes; raises CompileError with all faults found."""
    parser = _Parser()
    for line in lines(Source(name, text)):
        try:
            parser.read(line)
            line.finish()
        except LineFault as fault:
            parser.faults.append(fault.diagnostic)
            if len(parser.faults) == MAX_FAULTS:
                break
    faults = parser.faults
    if not faults and not parser.version:
        faults = [diagnostic("ir-syntax", "the text is empty, it is no scene")]
    if not faults:
        scene = parser.scene()
        faults = validate(scene)
    if faults:
        raise CompileError(faults)
    return scene


@dataclass(slots=True)
class _Group:
    """The instances of one group; inverses, low parts and sources where they are said."""

    targets: list[int] = field(default_factory=list)
    materials: list[int] = field(default_factory=list)
    forward: list[list[float]] = field(default_factory=list)
    inverse: dict[int, list[float]] = field(default_factory=dict)
    low: dict[int, list[float]] = field(default_factory=dict)
    sources: dict[int, int] = field(default_factory=dict)


@dataclass(slots=True)
class _Attribute:
    """An attribute of the mesh of that number."""

    mesh: int
    name: str
    width: int
    values: list[list[float]] = field(default_factory=list)
    corners: list[list[int]] = field(default_factory=list)


class _Parser:
    def __init__(self) -> None:
        self.faults: list[Diagnostic] = []
        self.version = 0
        self.texts = Texts()
        self.kinds: list[int] = []
        self.data: list[int] = []
        self.parameters: list[float] = []
        self.meshes: list[tuple[list[list[float]], list[list[int]]]] = []
        self.attributes: list[_Attribute] = []
        self.textures: list[NDArray[np.void]] = []
        self.materials: list[NDArray[np.void]] = []
        self.first_material: int | None = None
        self.groups: list[_Group] = []
        self.lights: list[NDArray[np.void]] = []
        self.cameras: list[NDArray[np.void]] = []
        self.settings = _defaults(ir.SETTINGS, SETTINGS_WORDS)
        self.origins: list[NDArray[np.void]] = []
        self.sources: list[tuple[int, int, int]] = []
        self._section: Callable[[Line], None] = self._outside

    def read(self, line: Line) -> None:
        if not self.version:
            line.expect("ovolo")
            line.expect("ir")
            if line.integer() != ir.VERSION:
                raise line.fault(f"this is not version {ir.VERSION} of the form")
            self.version = ir.VERSION
        elif line.indented:
            self._section(line)
        else:
            self._section = self._outside
            self._section = self._title(line)

    def _title(self, line: Line) -> Callable[[Line], None]:
        sections = {
            "prototypes": self._prototype,
            "materials": self._material,
            "textures": self._texture,
            "instances": self._instance,
            "group": self._instance,
            "lights": self._light,
            "cameras": self._camera,
            "settings": self._settings,
            "origins": self._origin,
            "sources": self._source,
        }
        title = tuple(sections)[line.choice(tuple(sections), "the title of a section")]
        if title in ("instances", "group"):
            number = line.integer(1) if title == "group" else 0
            if number != len(self.groups):
                raise line.fault("groups are numbered in order, from the instances on")
            self.groups.append(_Group())
        return sections[title]

    def _outside(self, line: Line) -> None:
        raise line.fault("this line belongs to no section")

    def _prototype(self, line: Line) -> None:
        if line.peek() in ("attribute", "value", "corners"):
            self._attribute(line)
            return
        if line.peek() in ("point", "face"):
            if not self.kinds or self.kinds[-1] != MESH:
                raise line.fault("this line belongs to no mesh")
            points, triangles = self.meshes[-1]
            if line.accept("point"):
                points.append(line.numbers(3))
            else:
                line.expect("face")
                triangles.append([line.integer() for _ in range(3)])
            return
        kind = line.choice(KINDS, "a kind of shape")
        parameters = () if kind == MESH else SHAPE_PARAMETERS[ShapeKind(KINDS[kind])]
        if line.integer(suffix=":" if parameters else "") != len(self.kinds):
            raise line.fault("prototypes are numbered in order, from 0 on")
        self.kinds.append(kind)
        if kind == MESH:
            self.data.append(len(self.meshes))
            self.meshes.append(([], []))
        else:
            self.data.append(len(self.parameters))
            self.parameters += [0.0] * len(parameters)
            for index, parameter in enumerate(parameters, self.data[-1]):
                line.expect(parameter)
                (self.parameters[index],) = line.numbers(1)

    def _attribute(self, line: Line) -> None:
        if line.accept("attribute"):
            if not self.kinds or self.kinds[-1] != MESH:
                raise line.fault("this line belongs to no mesh")
            name = line.text()
            self.attributes.append(_Attribute(len(self.meshes) - 1, name, line.integer(1, 64)))
            return
        if not self.attributes or self.attributes[-1].mesh != len(self.meshes) - 1:
            raise line.fault("this line belongs to no attribute")
        attribute = self.attributes[-1]
        if line.accept("value"):
            attribute.values.append(line.numbers(attribute.width))
        else:
            line.expect("corners")
            attribute.corners.append([line.integer() for _ in range(3)])

    def _texture(self, line: Line) -> None:
        parameter = line.choice(ir.TEXTURED, "a parameter of materials")
        line.expect("of")
        material = line.integer(suffix=":")
        file, attribute = line.text(), line.text()
        record = _record(line, ir.TEXTURE, TEXTURE_WORDS)
        record["parameter"], record["material"] = parameter, material
        record["file"], record["attribute"] = self.texts.index(file), self.texts.index(attribute)
        self.textures.append(record)

    def _material(self, line: Line) -> None:
        number = line.integer(suffix=":")
        if self.first_material is None and number <= 1:
            self.first_material = number
        if number != (self.first_material or 0) + len(self.materials):
            raise line.fault("materials are numbered in order, from 0 or 1 on")
        self.materials.append(_record(line, ir.MATERIAL, MATERIAL_WORDS))

    def _instance(self, line: Line) -> None:
        group = self.groups[-1]
        row = len(group.targets)
        kind = line.choice((*KINDS, "group"), "a kind of shape or `group`")
        number = line.integer()
        if kind < len(KINDS) and (number >= len(self.kinds) or self.kinds[number] != kind):
            raise line.fault(f"there is no prototype `{KINDS[kind]} {number}`")
        group.targets.append(number if kind < len(KINDS) else ~number)
        material = NO_MATERIAL
        if line.accept("material"):
            material = line.integer()
        elif line.accept("override"):
            material = overriding(line.integer(end=2**31 - 2))
        group.materials.append(material)
        still = IDENTITY_ROWS.ravel().tolist()
        group.forward.append(line.rows() if line.peek() == "[" else still)
        if line.accept("inverse"):
            group.inverse[row] = line.rows()
        if line.accept("low"):
            group.low[row] = line.numbers(3)
        if line.accept("source"):
            group.sources[row] = line.integer()

    def _light(self, line: Line) -> None:
        kind = line.choice(tuple(LIGHT_WORDS), "a kind of light")
        words = tuple(LIGHT_WORDS.values())[kind]
        texture = line.text() if kind == ir.SKY and line.peek().startswith('"') else ""
        record = _record(line, ir.LIGHT, (*words, *SKY_AXES) if texture else words)
        record["kind"] = kind
        if texture:
            record["file"] = 1 + self.texts.index(texture)
        self.lights.append(record)

    def _camera(self, line: Line) -> None:
        projection = line.choice(PROJECTIONS, "a projection")
        name = line.text() if line.peek().startswith('"') else ""
        record = _record(line, ir.CAMERA, CAMERA_WORDS)
        rows = line.rows() if line.peek() == "[" else IDENTITY_ROWS
        record["world_from_camera"] = np.reshape(rows, (3, 4))
        record["projection"], record["name"] = projection, self.texts.index(name)
        self.cameras.append(record)

    def _settings(self, line: Line) -> None:
        self.settings = _record(line, ir.SETTINGS, SETTINGS_WORDS)

    def _origin(self, line: Line) -> None:
        if line.integer(suffix=":") != len(self.origins):
            raise line.fault("origins are numbered in order, from 0 on")
        record = np.zeros((), dtype=ir.ORIGIN)
        record["point"] = line.choice(("label", "point"), "`label` or `point`")
        label, file = line.text(), line.text()
        record["file"] = self.texts.index(file)
        record["prim"] = -1
        if line.accept("prim"):
            record["prim"] = self.texts.index(line.text())
        else:
            record["start"], record["end"] = line.integer(end=2**62), line.integer(end=2**62)
        record["label"] = self.texts.index(label)
        self.origins.append(record)

    def _source(self, line: Line) -> None:
        if line.integer(suffix=":") != len(self.sources):
            raise line.fault("sources are numbered in order, from 0 on")
        line.expect("origin")
        origin = line.integer()
        parent = line.integer() if line.accept("below") else -1
        index = ir.COUNTED if line.accept("counted") else -1
        if line.accept("index"):
            index = line.integer()
        self.sources.append((origin, parent, index))

    def scene(self) -> SceneIR:
        """The arrays of what was read."""
        groups = self.groups or [_Group()]
        ends = np.cumsum([len(group.targets) for group in groups])
        ranges = np.stack([np.concatenate([[0], ends[:-1]]), ends], axis=1).astype(np.int64)
        count = int(ends[-1])
        target = np.array([t for g in groups for t in g.targets], dtype=np.int32)
        material = np.array([m for g in groups for m in g.materials], dtype=np.int32)
        forward = np.array([r for g in groups for r in g.forward]).reshape(count, 3, 4)
        low = np.zeros((count, 3), dtype=np.float32)
        inverse = np.zeros((count, 3, 4))
        source = np.full(count, -1, dtype=np.int32)
        for first, group in zip(ranges[:, 0], groups, strict=True):
            for row, values in group.low.items():
                low[first + row] = values
            for row, number in group.sources.items():
                source[first + row] = number
        if not low.any():
            low = low[:0]
        inverse = derived_inverses(forward, low)
        for first, group in zip(ranges[:, 0], groups, strict=True):
            for row, values in group.inverse.items():
                inverse[first + row] = np.reshape(values, (3, 4))
        attributes = self._attribute_arrays()
        text_ends, text_bytes = self.texts.arrays()
        columns = np.array(self.sources, dtype=np.int32).reshape(-1, 3).T
        return SceneIR(
            prototype_kind=np.array(self.kinds, dtype=np.uint8),
            prototype_data=np.array(self.data, dtype=np.int64),
            shape_parameters=np.array(self.parameters, dtype=np.float64),
            **self._mesh_arrays(),
            group_ranges=ranges,
            instance_target=target,
            world_from_object=forward,
            object_from_world=inverse,
            translation_low=low,
            instance_material=material,
            instance_source=source,
            materials=self._material_table(ranges, target, material),
            lights=np.array(self.lights, dtype=ir.LIGHT),
            cameras=np.array(self.cameras, dtype=ir.CAMERA),
            settings=np.array([self.settings], dtype=ir.SETTINGS),
            source_parent=np.ascontiguousarray(columns[1]),
            source_origin=np.ascontiguousarray(columns[0]),
            source_index=np.ascontiguousarray(columns[2]),
            origins=np.array(self.origins, dtype=ir.ORIGIN),
            text_ends=text_ends,
            text_bytes=text_bytes,
            **attributes,
            textures=np.array(self.textures, dtype=ir.TEXTURE),
        )

    def _material_table(
        self, ranges: NDArray[np.int64], target: NDArray[np.int32], material: NDArray[np.int32]
    ) -> NDArray[np.void]:
        listed = np.array(self.materials, dtype=ir.MATERIAL)
        unlisted = self.first_material == 1
        if self.first_material is None:
            unlisted = bool((material == 0).any() or (material == overriding(0)).any())
            unlisted |= self._lacks_material(ranges, target, material)
        return np.concatenate([material_table([DEFAULT_MATERIAL]), listed]) if unlisted else listed

    def _lacks_material(
        self, ranges: NDArray[np.int64], target: NDArray[np.int32], material: NDArray[np.int32]
    ) -> bool:
        # Groups that are not there are for `validate` to report.
        return bool((~target < len(ranges)).all()) and needs_default_material(
            ranges, target, material
        )

    def _attribute_arrays(self) -> dict[str, NDArray[Any]]:
        rows: list[tuple[int, ...]] = []
        values: list[float] = []
        corners: list[int] = []
        for attribute in self.attributes:
            first = len(values)
            values += [number for value in attribute.values for number in value]
            at = len(corners) if attribute.corners else -1
            corners += [corner for triangle in attribute.corners for corner in triangle]
            name = self.texts.index(attribute.name)
            rows.append((attribute.mesh, name, attribute.width, 0, first, len(values), at))
        return {
            "mesh_attributes": np.array(rows, dtype=ir.MESH_ATTRIBUTE),
            "attribute_values": np.array(values, dtype=np.float32),
            "attribute_corners": np.array(corners, dtype=np.int32),
        }

    def _mesh_arrays(self) -> dict[str, NDArray[Any]]:
        ends = np.array([[len(p), len(t)] for p, t in self.meshes]).reshape(-1, 2).cumsum(axis=0)
        firsts = np.concatenate([np.zeros((1, 2)), ends])[:-1]
        ranges = np.stack([firsts[:, 0], ends[:, 0], firsts[:, 1], ends[:, 1]], axis=1)
        points = itertools.chain.from_iterable(p for p, _ in self.meshes)
        triangles = itertools.chain.from_iterable(t for _, t in self.meshes)
        return {
            "mesh_ranges": ranges.astype(np.int64),
            "mesh_points": np.array(list(points), dtype=np.float64).reshape(-1, 3),
            "mesh_triangles": np.array(list(triangles), dtype=np.int32).reshape(-1, 3),
        }


def _defaults(dtype: np.dtype[np.void], words: Sequence[Word]) -> NDArray[np.void]:
    record = np.zeros((), dtype=dtype)
    for word in words:
        if word.default is not None:
            record[word.field] = word.default if word.count > 1 else word.default[0]
    return record


def _record(line: Line, dtype: np.dtype[np.void], words: Sequence[Word]) -> NDArray[np.void]:
    """A record of what the rest of the line says, in order; the defaults for what it does not."""
    record = _defaults(dtype, words)
    for word in words:
        if word.default is None:
            line.expect(word.word)
        elif not line.accept(word.word):
            continue
        if word.choices:
            record[word.field] = line.choice(word.choices, f"one of {', '.join(word.choices)}")
        elif dtype[word.field].kind == "i":
            record[word.field] = line.integer()
        else:
            values = line.numbers(word.count)
            record[word.field] = values if word.count > 1 else values[0]
    return record
