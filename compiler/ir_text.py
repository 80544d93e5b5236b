"""SceneIR → its canonical text: for eyes, and for tests that compare byte for byte.

    ovolo ir 1
    prototypes
      sphere 0: radius 1
    materials
      1: diffuse 0.8 0.55 0.4 roughness 1
    textures
      diffuse of 1: "brick.png" "st" channels rgb wrap_s repeat
    instances
      sphere 0 [1 0 0 3 | 0 1 0 0 | 0 0 1 0]
      group 1 material 1
    group 1
      sphere 0 [1 0 0 0 | 0 4 0 10 | 0 0 1 0]
      sphere 0
    lights
      sun direction 0 -1 0 irradiance 3 3 3
    cameras
      perspective height 0.75 [1 0 0 0 | 0 1 0 0 | 0 0 1 60]
    settings
      width 640 height 480

Sections and fields come in this order; what is empty, or has its default value, is not written.
A mesh's lines are its points, faces and attributes.
Floats are the shortest that read back the same. An instance's line holds its target, `material m`
or `override m`, the rows of `world_from_object` (none: the identity), `inverse` and the rows of
`object_from_world` unless they are what inverting the rows before gives, and `low` with
`translation_low` unless it is zero. Material 0 is not listed where it is the default material.
Sources are left out unless asked for: two front ends that mean the same give the same text.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from compiler import ir
from compiler.attributes import mesh_attributes
from compiler.inverses import derived_inverses
from compiler.ir import SceneIR
from dsl.scene import (
    DEFAULT_MATERIAL,
    MATERIAL_PARAMETERS,
    SHAPE_PARAMETERS,
    MeshAttribute,
    ShapeKind,
)

IDENTITY_ROWS = np.eye(3, 4)


@dataclass(frozen=True, slots=True)
class Word:
    """One field of a record in the text: `word` and its numbers, left out if all are `default`."""

    word: str
    field: str
    count: int
    default: tuple[float, ...] | None = None
    choices: tuple[str, ...] | None = None


def _material_words() -> Iterator[Word]:
    for name in MATERIAL_PARAMETERS:
        value = getattr(DEFAULT_MATERIAL, name)
        numbers = value if isinstance(value, tuple) else (float(value),)
        yield Word(name, name, len(numbers), numbers)


MATERIAL_WORDS = tuple(_material_words())
_SHAPING_WORDS = (
    Word("cone", "cone", 1, (180.0,)),
    Word("softness", "softness", 1, (0.0,)),
    Word("focus", "focus", 1, (0.0,)),
)
_SURFACE_WORDS = (
    Word("position", "vector", 3),
    Word("radiance", "color", 3),
    Word("u", "u", 3),
    Word("v", "v", 3),
    Word("w", "w", 3),
    *_SHAPING_WORDS,
)
LIGHT_WORDS = {
    "sun": (
        Word("direction", "vector", 3),
        Word("irradiance", "color", 3),
        Word("angle", "size", 1, (0.0,)),
    ),
    "point": (
        Word("position", "vector", 3),
        Word("intensity", "color", 3),
        Word("radius", "size", 1, (0.0,)),
        Word("direction", "w", 3, (0.0, 0.0, 0.0)),
        *_SHAPING_WORDS,
    ),
    "sky": (Word("radiance", "color", 3),),
    "rectangle": _SURFACE_WORDS,
    "disc": _SURFACE_WORDS,
    "cylinder": _SURFACE_WORDS,
}
"""By `LIGHT["kind"]`, in order."""
SKY_AXES = (
    Word("u", "u", 3, (1.0, 0.0, 0.0)),
    Word("v", "v", 3, (0.0, 1.0, 0.0)),
    Word("w", "w", 3, (0.0, 0.0, 1.0)),
)
"""What skies with a texture have beside."""
TEXTURE_WORDS = (
    Word("channels", "channels", 1, None, ir.CHANNELS),
    Word("wrap_s", "wrap_s", 1, (ir.WRAPS.index("useMetadata"),), ir.WRAPS),
    Word("wrap_t", "wrap_t", 1, (ir.WRAPS.index("useMetadata"),), ir.WRAPS),
    Word("color_space", "color_space", 1, (0,), ir.COLOR_SPACES),
    Word("scale", "scale", 4, (1.0, 1.0, 1.0, 1.0)),
    Word("bias", "bias", 4, (0.0, 0.0, 0.0, 0.0)),
    Word("fallback", "fallback", 4, (0.0, 0.0, 0.0, 1.0)),
    Word("matrix", "matrix", 6, (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)),
)
PROJECTIONS = ("perspective", "orthographic")
CAMERA_WORDS = (
    Word("height", "height", 1),
    Word("aspect", "aspect", 1, (math.nan,)),
    Word("shift", "shift", 2, (0.0, 0.0)),
    Word("near", "near", 1, (0.0,)),
    Word("far", "far", 1, (math.inf,)),
    Word("exposure", "exposure", 1, (0.0,)),
    Word("lens_radius", "lens_radius", 1, (0.0,)),
    Word("focus_distance", "focus_distance", 1, (0.0,)),
    Word("shutter", "shutter", 2, (0.0, 0.0)),
)
SETTINGS_WORDS = (
    Word("width", "width", 1, (0,)),
    Word("height", "height", 1, (0,)),
    Word("samples", "samples", 1, (0,)),
    Word("integrator", "integrator", 1, (-1,), ir.INTEGRATORS),
    Word("precision", "precision", 1, (-1,), ir.PRECISIONS),
    Word("up", "up", 1, (0,), ir.UP_AXES),
    Word("occlusion_distance", "occlusion_distance", 1, (math.nan,)),
    Word("exposure", "exposure", 1, (math.nan,)),
)


def print_ir(scene: SceneIR, *, sources: bool = False) -> str:
    """The text of `scene`; with `sources` also the tables that say where instances come from."""
    lines = [f"ovolo ir {ir.VERSION}"]
    for title, body in (
        ("prototypes", _prototypes(scene)),
        ("materials", _materials(scene)),
        ("textures", _textures(scene)),
        *_groups(scene, sources),
        ("lights", _lights(scene)),
        ("cameras", _cameras(scene)),
        (
            "settings",
            (line for line in [" ".join(_words(scene.settings[0], SETTINGS_WORDS))] if line),
        ),
        ("origins", _origins(scene) if sources else ()),
        ("sources", _sources(scene) if sources else ()),
    ):
        written = [f"  {line}" for line in body]
        if written or title.startswith("group"):
            lines += [title, *written]
    return "\n".join(lines) + "\n"


def number(value: float) -> str:
    """The shortest text that reads back as `value`; zero has no sign."""
    return repr(float(value) + 0.0).removesuffix(".0")


def name(scene: SceneIR, target: int) -> str:
    """What an instance's target is called: `sphere 0`, `mesh 3`, `group 1`."""
    return (
        f"group {~target}" if target < 0 else f"{ir.KINDS[scene.prototype_kind[target]]} {target}"
    )


def _prototypes(scene: SceneIR) -> Iterator[str]:
    for prototype, (kind, data) in enumerate(
        zip(scene.prototype_kind, scene.prototype_data, strict=True)
    ):
        if kind == ir.MESH:
            first_point, end_point, first, end = scene.mesh_ranges[data]
            yield name(scene, prototype)
            for point in scene.mesh_points[first_point:end_point]:
                yield f"  point {_numbers(point)}"
            for triangle in scene.mesh_triangles[first:end]:
                yield f"  face {_numbers(triangle)}"
            for attribute in mesh_attributes(scene, int(data)):
                yield from _attribute(attribute)
            continue
        parameters = SHAPE_PARAMETERS[ShapeKind(ir.KINDS[kind])]
        values = scene.shape_parameters[data : data + len(parameters)]
        said = " ".join(f"{p} {number(v)}" for p, v in zip(parameters, values, strict=True))
        yield f"{name(scene, prototype)}: {said}" if said else name(scene, prototype)


def _materials(scene: SceneIR) -> Iterator[str]:
    for material, record in enumerate(scene.materials):
        said = " ".join(_words(record, MATERIAL_WORDS))
        if said or material:
            yield f"{material}: {said}".rstrip()


def _attribute(attribute: MeshAttribute) -> Iterator[str]:
    called = json.dumps(attribute.name, ensure_ascii=False)
    yield f"  attribute {called} {attribute.values.shape[1]}"
    for value in attribute.values:
        yield f"  value {' '.join(map(_single, value))}"
    if attribute.corners is not None:
        for triangle in attribute.corners:
            yield f"  corners {_numbers(triangle)}"


def _textures(scene: SceneIR) -> Iterator[str]:
    for record in scene.textures:
        file, attribute = (
            json.dumps(scene.text(int(record[name])), ensure_ascii=False)
            for name in ("file", "attribute")
        )
        said = " ".join(_words(record, TEXTURE_WORDS))
        parameter = ir.TEXTURED[record["parameter"]]
        yield f"{parameter} of {record['material']}: {file} {attribute} {said}"


def _groups(scene: SceneIR, sources: bool) -> Iterator[tuple[str, Iterable[str]]]:
    for group, (first, end) in enumerate(scene.group_ranges):
        yield f"group {group}" if group else "instances", _instances(scene, first, end, sources)


def _instances(scene: SceneIR, first: int, end: int, sources: bool) -> Iterator[str]:
    forward = scene.world_from_object[first:end]
    inverse = scene.object_from_world[first:end]
    low = scene.translation_low[first:end]
    derived = derived_inverses(forward, low)
    same = (inverse == derived).all(axis=(1, 2))
    still = (forward == IDENTITY_ROWS).all(axis=(1, 2))
    for row in range(end - first):
        words = [name(scene, int(scene.instance_target[first + row]))]
        material = int(scene.instance_material[first + row])
        if material >= 0:
            words.append(f"material {material}")
        elif material < -1:
            words.append(f"override {-2 - material}")
        if not still[row]:
            words.append(_rows(forward[row]))
        if not same[row]:
            words.append(f"inverse {_rows(inverse[row])}")
        if len(low) and low[row].any():
            words.append("low " + " ".join(_single(np.float32(v)) for v in low[row]))
        if sources and scene.instance_source[first + row] >= 0:
            words.append(f"source {scene.instance_source[first + row]}")
        yield " ".join(words)


def _lights(scene: SceneIR) -> Iterator[str]:
    for light, record in enumerate(scene.lights):
        kind = tuple(LIGHT_WORDS)[record["kind"]]
        words = [kind, *_words(record, LIGHT_WORDS[kind])]
        if texture := scene.sky_texture(light):
            words.insert(1, json.dumps(texture, ensure_ascii=False))
            words += _words(record, SKY_AXES)
        yield " ".join(words)


def _cameras(scene: SceneIR) -> Iterator[str]:
    for record in scene.cameras:
        words = [PROJECTIONS[record["projection"]]]
        if called := scene.text(int(record["name"])):
            words.append(json.dumps(called, ensure_ascii=False))
        words += _words(record, CAMERA_WORDS)
        if (record["world_from_camera"] != IDENTITY_ROWS).any():
            words.append(_rows(record["world_from_camera"]))
        yield " ".join(words)


def _origins(scene: SceneIR) -> Iterator[str]:
    for index, record in enumerate(scene.origins):
        quoted = json.dumps(scene.text(int(record["file"])), ensure_ascii=False)
        if record["prim"] >= 0:
            prim = json.dumps(scene.text(int(record["prim"])), ensure_ascii=False)
            place = f"{quoted} prim {prim}"
        else:
            place = f"{quoted} {record['start']} {record['end']}"
        label = json.dumps(scene.text(int(record["label"])), ensure_ascii=False)
        yield f"{index}: {'point' if record['point'] else 'label'} {label} {place}"


def _sources(scene: SceneIR) -> Iterator[str]:
    columns = scene.source_origin, scene.source_parent, scene.source_index
    for source, (origin, parent, index) in enumerate(zip(*columns, strict=True)):
        words = [f"{source}: origin {origin}"]
        if parent >= 0:
            words.append(f"below {parent}")
        if index != -1:
            words.append("counted" if index == ir.COUNTED else f"index {index}")
        yield " ".join(words)


def _words(record: np.void, words: Sequence[Word]) -> Iterator[str]:
    for word in words:
        values = np.atleast_1d(record[word.field])
        if word.default is not None and np.array_equal(values, word.default, equal_nan=True):
            continue
        if word.choices:
            yield f"{word.word} {word.choices[int(values[0])]}"
        else:
            yield f"{word.word} {_numbers(values)}"


def _numbers(values: Iterable[float]) -> str:
    return " ".join(number(value) for value in values)


def _rows(matrix: NDArray[np.float64]) -> str:
    return "[" + " | ".join(_numbers(row) for row in matrix) + "]"


def _single(value: np.float32) -> str:
    text = str(value + np.float32(0.0)).removesuffix(".0")
    return text if np.float32(float(text)) == value else number(float(value))
