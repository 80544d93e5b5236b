"""The scene graph: what a program, or a USD stage, denotes.

A directed acyclic graph of frozen nodes. Sharing is identity: one node referred to from two
places is one prototype with two instances, so graphs are compared and memoised by `id`, never by
value. Depth is unbounded (a chain of 100 000 transforms is a chain of nodes): whoever walks a
graph uses an explicit stack.

Conventions: right-handed, y up, points are column vectors, angles in degrees (degrees can be
reduced exactly), colours linear Rec. 709.
"""

from __future__ import annotations

from dataclasses import field, fields
from enum import StrEnum
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from dsl.diagnostics import Diagnostic
from dsl.records import node, value
from dsl.spans import Place

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Vector = tuple[float, float, float]
Color = tuple[float, float, float]


@value
class Origin:
    """What made a node, and its segment of the object path.

    Paths read from the root: segments are joined by "/" unless the next one begins with "/"
    (USD prim paths do, and are relative to the enclosing native instance; with "//" they are
    relative to the stage, for prototypes that are not within it). A `point` origin (a
    point instancer) comes last instead: `inner@label[index]`, innermost first.
    `index` is the number of the edge among its siblings (a loop's iteration); for a batch of
    `Instances` the batch supplies the index of each edge itself. An empty `label` adds nothing to
    the path but keeps the place.
    """

    place: Place
    label: str = ""
    index: int | None = None
    point: bool = False


class StepKind(StrEnum):
    """The elementary affine maps; `values` of a `Step` are listed here in order."""

    __hash__ = str.__hash__  # that of Enum is ten times as slow

    TRANSLATE = "translate"  # x y z
    SCALE = "scale"  # x y z
    ROTATE = "rotate"  # axis x y z, angle in degrees, right-handed
    ORIENT = "orient"  # quaternion x y z w, 1 + 2w[v]× + 2[v]×² as in USD: near unit, a rotation
    SHEAR = "shear"  # xy xz yx yz zx zy: x' = x + xy·y + xz·z, and so on
    REFLECT = "reflect"  # normal x y z of the mirror plane through the origin
    MATRIX = "matrix"  # 12 numbers, 3x4 row by row
    LOOK_AT = "look_at"  # from xyz, at xyz, up xyz: object -z looks at `at`, y near `up`


@node
class Step:
    """One elementary map, or its exact inverse.

    `values` has shape `(k,)`, or `(n, k)` for a batch of n; of a batch they may be floats or halfs.
    """

    kind: StepKind
    values: NDArray[np.floating[Any]]
    inverse: bool = False


@node
class Transform:
    """A chain of elementary maps in reading order: the first is applied to the object first.

    Every step's batch size is the same n, or the step is unbatched and holds for all. Between the
    steps at the `breaks` (numbers of the steps above them; at 0 the child's own maps are apart) the
    chain is composed in parts, as the maps of an object and of a group around it are.
    """

    steps: tuple[Step, ...] = ()
    breaks: tuple[int, ...] = ()

    @property
    def count(self) -> int | None:
        """The batch size n, or None for a single transform."""
        for step in self.steps:
            if step.values.ndim == 2:
                return len(step.values)
        return None

    def inverted(self) -> Transform:
        """The exact inverse: the steps in reverse order, each inverted."""
        return Transform(tuple(Step(s.kind, s.values, not s.inverse) for s in reversed(self.steps)))


class ShapeKind(StrEnum):
    """The analytic solids and surfaces that the kernel intersects exactly."""

    __hash__ = str.__hash__  # that of Enum is ten times as slow

    SPHERE = "sphere"
    BOX = "box"
    CYLINDER = "cylinder"
    CONE = "cone"
    TORUS = "torus"
    DISC = "disc"
    RECTANGLE = "rectangle"
    PLANE = "plane"
    TRIANGLE = "triangle"
    RING = "ring"
    WEDGE = "wedge"


SHAPE_PARAMETERS: dict[ShapeKind, tuple[str, ...]] = {
    ShapeKind.SPHERE: ("radius",),
    ShapeKind.BOX: ("x0", "y0", "z0", "x1", "y1", "z1", "bevel"),
    ShapeKind.CYLINDER: ("radius", "y0", "y1", "bevel"),
    ShapeKind.CONE: ("radius", "height", "bevel"),
    ShapeKind.TORUS: ("major", "minor"),
    ShapeKind.DISC: ("radius",),
    ShapeKind.RECTANGLE: ("size_x", "size_z"),
    ShapeKind.PLANE: (),
    ShapeKind.TRIANGLE: ("ax", "ay", "az", "bx", "by", "bz", "cx", "cy", "cz"),
    ShapeKind.RING: ("r0", "r1", "y0", "y1", "bevel"),
    ShapeKind.WEDGE: ("r0", "r1", "y0", "y1", "phi0", "phi1", "bevel"),
}
"""Parameters of each kind, in order: lengths in object units, `phi0` and `phi1` in degrees.

Solids have outward normals; disc, rectangle and plane lie in y = 0 with normal +y; a triangle's
normal is (b - a) × (c - a).
"""


@node
class Shape:
    """An analytic shape in its own space; `parameters` as in `SHAPE_PARAMETERS[kind]`.

    One that is `sized` is the unit of a batch above it whose first step gives more sizes than are
    prototypes of their own, see `dsl.sizes`.
    """

    kind: ShapeKind
    parameters: tuple[float, ...]
    origin: Origin | None = None
    sized: bool = False


@node
class MeshAttribute:
    """Numbers that vary over a mesh, linearly within a triangle, for shading only.

    `values` `(k, w)` float32, finite; `corners` `(m, 3)` the row of each corner of each triangle,
    None where the rows are those of the mesh's points. Names are USD's: "normals" (object space,
    outward, not unit), "displayColor", "displayOpacity", "st" and whatever textures name.
    """

    name: str
    values: NDArray[np.float32]
    corners: NDArray[np.integer] | None = None


@node
class Mesh:
    """A triangle mesh.

    `points` `(v, 3)` float64, `triangles` `(m, 3)` int64 indices into points; a triangle's normal
    is (b - a) × (c - a), whatever its attributes say. The maker has dropped faces with bad
    indices or NaN points.
    """

    points: FloatArray
    triangles: IntArray
    origin: Origin | None = None
    attributes: tuple[MeshAttribute, ...] = ()


@node
class File:
    """An object to be read from a file when the scene is flattened: `mesh("…")`, `usd("…")`.

    `path` as written; resolved against the folder of the file that names it. `prim` restricts a
    USD stage to one prim.
    """

    kind: Literal["mesh", "usd"]
    path: str
    prim: str | None = None
    folder: str | None = None
    origin: Origin | None = None


@value
class Texture:
    """A picture, or an attribute of meshes, that gives one parameter of a material (UsdUVTexture).

    `parameter` is a field of Material, "normal", "displacement" or "occlusion". `file` is "" where
    the attribute itself is the value. Coordinates are the attribute times `matrix` (2x3, row by
    row), origin at the lower left; a texel is `scale` times the picture's plus `bias`, by
    channel, of which `channels` are used; `fallback` where the file cannot be read.
    """

    parameter: str
    file: str
    attribute: str = "st"
    channels: Literal["r", "g", "b", "a", "rgb"] = "rgb"
    wrap: tuple[Wrap, Wrap] = ("useMetadata", "useMetadata")
    color_space: Literal["auto", "raw", "sRGB"] = "auto"
    scale: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    bias: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    fallback: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    matrix: tuple[float, float, float, float, float, float] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)


Wrap = Literal["black", "clamp", "repeat", "mirror", "useMetadata"]


@value
class Material:
    """The parameters of UsdPreviewSurface; colours linear. Equal materials are one.

    A parameter that has one of the `textures` is its value where the texture is not used.
    """

    diffuse: Color = (0.18, 0.18, 0.18)
    emission: Color = (0.0, 0.0, 0.0)
    specular_workflow: bool = False
    specular: Color = (0.0, 0.0, 0.0)
    metallic: float = 0.0
    roughness: float = 0.5
    clearcoat: float = 0.0
    clearcoat_roughness: float = 0.01
    opacity: float = 1.0
    opacity_threshold: float = 0.0
    ior: float = 1.5
    textures: tuple[Texture, ...] = ()


DEFAULT_MATERIAL = Material()

MATERIAL_PARAMETERS = tuple(f.name for f in fields(Material) if f.name != "textures")
"""The constants of a material, in order."""

MATERIAL_FRACTIONS = (
    "metallic",
    "roughness",
    "clearcoat",
    "clearcoat_roughness",
    "opacity",
    "opacity_threshold",
)
"""Those of them that lie in 0 to 1."""


@node
class Group:
    """Several nodes as one, in order of emission.

    With an `order`, items that are batches are emitted edge by edge: of the edges of all items,
    listed one item after the other, that of number `order[k]` comes k-th.
    """

    items: tuple[Node, ...]
    origin: Origin | None = None
    order: IntArray | None = None


@node
class Instances:
    """A child placed by one transform, or n times by a batch of n.

    `indices` `(n,)` number a batch's edges in the object path (default 0 … n - 1).
    """

    child: Node
    transform: Transform
    indices: IntArray | None = None
    origin: Origin | None = None


@node
class Bind:
    """A material bound to whatever is below.

    Inherited: what is below and has a material of its own keeps it (the innermost wins).
    Override: wins over everything below (the outermost override wins).
    """

    child: Node
    material: Material
    override: bool = False
    origin: Origin | None = None


@node
class Sun:
    """Parallel light.

    `direction` is where the light travels (any length); `irradiance` on a surface that faces it;
    `angle` is the angular diameter in degrees: 0 casts hard shadows.
    """

    direction: Vector
    irradiance: Color
    angle: float = 0.0
    origin: Origin | None = None


@value
class Shaping:
    """In which directions a light shines how much (UsdLuxShapingAPI).

    Nothing leaves at more than `cone` degrees from the light's axis; from (1 - `softness`) · `cone`
    on it falls smoothly. What leaves is multiplied by the `focus`-th power of the angle's cosine.
    """

    cone: float = 180.0
    softness: float = 0.0
    focus: float = 0.0


UNSHAPED = Shaping()


@node
class PointLight:
    """Light from a point, or from a ball of `radius` (soft shadows).

    `intensity` is power per solid angle: irradiance at distance r is intensity / r². A `shaping`
    is around the `direction`, of any length.
    """

    position: Vector
    intensity: Color
    radius: float = 0.0
    origin: Origin | None = None
    direction: Vector = (0.0, -1.0, 0.0)
    shaping: Shaping = UNSHAPED


AreaKind = Literal["rectangle", "disc", "cylinder"]


@node
class AreaLight:
    """Light of one `radiance` from a surface around `position`, which pictures do not show.

    With the `axes` u, v and w: a rectangle is s u + t v with s and t in -1 … 1, a disc the same
    with s² + t² ≤ 1, and they shine to the side of w; a cylinder is s u + cos φ v + sin φ w,
    shines outwards, and its ends are dark. A `shaping` is around the normal, or a cylinder's w.
    Transforms move the surface point by point.
    """

    kind: AreaKind
    radiance: Color
    axes: tuple[Vector, Vector, Vector]
    position: Vector = (0.0, 0.0, 0.0)
    shaping: Shaping = UNSHAPED
    origin: Origin | None = None


@node
class Sky:
    """Radiance from every direction, which is also the background.

    With a `texture`, the path of a latitude-longitude picture, the `radiance` is multiplied by it:
    its upper edge is +y of the sky's own space, its middle +z, and the middle of its left half +x
    (as in OpenEXR). Transforms turn and mirror it. Without a texture they do nothing.
    """

    radiance: Color
    origin: Origin | None = None
    texture: str = ""


@node
class Camera:
    """A camera in its own space: at the origin, looking along -z, y up.

    Placed by the `Instances` above it. `height` is the full height of the picture's window: on
    the plane at distance 1 for a perspective camera (2·tan(fov/2)), in camera units for an
    orthographic one. `aspect` is width over height of the window; None takes the picture's.
    A picture of another aspect shows the whole window and more. `shift` moves the window by
    fractions of its width and height. `near`, `far`: distances along the viewing axis outside of
    which nothing is seen. `exposure` makes the picture brighter, in stops. Pictures are taken
    through a pinhole at one time: `lens_radius` and `focus_distance` (camera units, 0: not said)
    and `shutter`, when it opens and closes in time codes from the picture's, are only kept.
    """

    projection: Literal["perspective", "orthographic"]
    height: float
    aspect: float | None = None
    shift: tuple[float, float] = (0.0, 0.0)
    near: float = 0.0
    far: float = float("inf")
    name: str = ""
    origin: Origin | None = None
    exposure: float = 0.0
    lens_radius: float = 0.0
    focus_distance: float = 0.0
    shutter: tuple[float, float] = (0.0, 0.0)


Integrator = Literal["direct", "ambient_occlusion", "normals", "ids"]
Precision = Literal["float32", "float64"]
UpAxis = Literal["y", "z"]


@node
class Settings:
    """What a scene asks of its picture; None leaves the choice to the caller or the default.

    `up` is the axis that points up where a camera has to be made up (USD stages say it; None is
    "y"); it never moves geometry. `product` is what a stage calls the picture's file, only kept.
    """

    width: int | None = None
    height: int | None = None
    samples: int | None = None
    integrator: Integrator | None = None
    precision: Precision | None = None
    occlusion_distance: float | None = None
    exposure: float | None = None
    up: UpAxis | None = None
    origin: Origin | None = None
    product: str | None = None


Plain = float | bool | str | tuple[float, ...]
"""A value that a parameter can be set to; angles are text with their unit."""


@value
class Param:
    """A value of a program that may be set from outside.

    `value` holds, `default` if it is not set; between `low` and `high` (both allowed), or one of
    `choices`, where the program says so. `doc` is its documentation.
    """

    name: str
    value: Plain
    default: Plain
    low: Plain | None = None
    high: Plain | None = None
    choices: tuple[Plain, ...] = ()
    doc: str = ""


Light = Sun | PointLight | AreaLight | Sky
Node = Shape | Mesh | File | Group | Instances | Bind | Light | Camera | Settings


@node
class SceneGraph:
    """The root of a scene and where it came from.

    `sources` maps the names of the files that took part to their text (stages: to nothing).
    `params` are those of the program itself, in order; `advice` are warnings about its names.
    """

    root: Node
    name: str = "scene"
    sources: dict[str, str] = field(default_factory=dict)
    params: tuple[Param, ...] = ()
    advice: tuple[Diagnostic, ...] = ()
