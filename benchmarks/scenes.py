"""The scenes and rays that every benchmark shares, made here so that nothing need be fetched.

S1 the seed's 256 ellipsoids; S2 an igloo of 311 bevelled blocks on the ground, exact or as 20 172
triangles each; S4 a million instances of a sphere or of a 1 280-triangle mesh; S5 three nested
levels of 1000 (10⁹ leaves).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from dsl.scene import (
    Camera,
    FloatArray,
    Group,
    Instances,
    IntArray,
    Mesh,
    Node,
    SceneGraph,
    Shape,
    ShapeKind,
    Step,
    StepKind,
    Transform,
)

SPHERE = Shape(ShapeKind.SPHERE, (1.0,))


@dataclass(frozen=True, slots=True)
class View:
    """A pinhole camera, and its rays through pixel centres in 4 × 4 tiles."""

    eye: tuple[float, float, float]
    at: tuple[float, float, float]
    up: tuple[float, float, float]
    fov: float
    width: int
    height: int

    def resized(self, width: int, height: int) -> View:
        """The same view in another resolution."""
        return replace(self, width=width, height=height)

    def frame(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """From the eye to the middle of the picture, and half its width and height from there."""
        forward = _unit(np.array(self.at) - np.array(self.eye))
        right = _unit(np.cross(forward, np.array(self.up)))
        tall = math.tan(math.radians(self.fov) / 2)
        above = np.cross(right, forward)
        return forward, right * tall * self.width / self.height, above * tall

    def camera(self) -> Node:
        """The camera of this view."""
        forward, right, above = (_unit(v) for v in self.frame())
        matrix = np.stack([right, above, -forward, np.array(self.eye, float)], 1)
        height = 2 * math.tan(math.radians(self.fov) / 2)
        place = Transform((_step(StepKind.MATRIX, *matrix.ravel()),))
        return Instances(Camera("perspective", height), place)

    def rays(self, count: int | None = None) -> tuple[FloatArray, FloatArray]:
        """Origins and unit directions, `(n, 3)` each, 16 consecutive rays to a tile.

        All, or about `count` of them: whole tiles, evenly over the picture.
        """
        columns = self.width // 4
        tiles = columns * (self.height // 4)
        kept = tiles if count is None else max(min(count // 16, tiles), 1)
        tile = (np.arange(kept) * tiles // kept)[:, None]
        place = np.arange(16)
        x = (tile % columns * 4 + place % 4).reshape(-1, 1)
        y = (tile // columns * 4 + place // 4).reshape(-1, 1)
        forward, right, above = self.frame()
        directions = (
            forward
            + ((2 * x + 1) / self.width - 1) * right
            + (1 - (2 * y + 1) / self.height) * above
        )
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        # The peers read float32 rays; the same values go to everybody.
        directions = directions.astype(np.float32).astype(np.float64)
        return np.broadcast_to(np.array(self.eye, float), directions.shape).copy(), directions


S1_VIEW = View((24, 20, 36), (0, 0, 0), (0, 1, 0), 36, 1024, 1024)
S2_VIEW = View((9, -7, 5), (0, 0, 1.2), (0, 0, 1), 36, 512, 512)
S4_VIEW = View((260, 190, 330), (0, 0, 0), (0, 1, 0), 36, 1024, 1024)
BALL_VIEW = View((16, 11, 22), (0, 0, 0), (0, 1, 0), 36, 1024, 1024)
SOUP_VIEW = View((26, 19, 33), (0, 0, 0), (0, 1, 0), 36, 1024, 1024)
S5_VIEW = View((26, 19, 33), (0, 0, 0), (0, 1, 0), 36, 1024, 1024)


def ellipsoids() -> SceneGraph:
    """S1: 256 instances of one sphere, i the slower index."""
    i, j = (a.ravel() * 22.5 for a in np.mgrid[0:16, 0:16])
    chain = Transform(
        (
            _step(StepKind.SCALE, 1, 4, 1),
            _step(StepKind.TRANSLATE, 0, 10, 0),
            _turn((0, 0, 1), i),
            _turn((1, 0, 0), j),
        )
    )
    return SceneGraph(Instances(SPHERE, chain), "ellipsoids")


RADIUS, THICKNESS, RINGS, WIDTH, EDGE = 3.0, 0.55, 11, 0.405, 0.05
HEIGHT = RADIUS * (math.pi / 2) / RINGS


def igloo(*, triangles: bool) -> SceneGraph:
    """S2: blocks bent round the z axis, z up; exact bevelled wedges, or their tessellation."""
    azimuth, latitude, stretch = [], [], []
    for ring in range(RINGS):
        angle = (ring + 0.5) * 90 / RINGS
        around = 2 * math.pi * RADIUS * math.cos(math.radians(angle))
        count = max(3, round(around / WIDTH))
        for i in range(count):
            turn = 360 * (i + 0.5 * (ring % 2)) / count
            if ring < 4 and abs((turn + 215) % 360 - 180) < 14:
                continue  # the door
            azimuth.append(turn)
            latitude.append(-angle)
            stretch.append(around / count / WIDTH * 0.985)
    n = len(azimuth)
    scale = np.stack([np.ones(n), np.array(stretch), np.ones(n)], 1)
    chain = Transform(
        (
            Step(StepKind.SCALE, scale),
            _step(StepKind.TRANSLATE, RADIUS, 0, 0),
            _turn((0, 1, 0), np.array(latitude)),
            _turn((0, 0, 1), np.array(azimuth)),
        )
    )
    block: Node = block_mesh() if triangles else _wedge_block()
    ground = Mesh(
        np.array([[-60, -60, 0], [60, -60, 0], [60, 60, 0], [-60, 60, 0]], float),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    return SceneGraph(Group((Instances(block, chain), ground)), "igloo")


def _wedge_block() -> Node:
    """The block of S2 about its own middle: a wedge round z, whose azimuth 0 is +x."""
    half = math.degrees(WIDTH / 2 / RADIUS)
    wedge = Shape(
        ShapeKind.WEDGE,
        (
            RADIUS - THICKNESS / 2,
            RADIUS + THICKNESS / 2,
            -HEIGHT / 2,
            HEIGHT / 2,
            -half,
            half,
            EDGE,
        ),
    )
    # Object (x, y, z), azimuth from +z towards +x, goes to (z, x, y): the axis y becomes z.
    turn = _step(StepKind.MATRIX, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0)
    return Instances(wedge, Transform((turn, _step(StepKind.TRANSLATE, -RADIUS, 0, 0))))


def block_mesh(cells: int = 41) -> Mesh:
    """The block of S2 as 12·cells² triangles: a rounded box, bent round the z axis."""
    half = np.array([THICKNESS, WIDTH, HEIGHT]) / 2
    edge = max(3, cells // 4)

    def ticks(extent: float) -> FloatArray:
        strip = np.linspace(0, EDGE, edge, endpoint=False)
        flat = np.linspace(EDGE - extent, extent - EDGE, cells - 2 * edge, endpoint=False)
        return np.concatenate([strip - extent, flat, extent - EDGE + np.append(strip, EDGE)])

    points, faces, first = [], [], 0
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        grid = np.meshgrid(ticks(half[u]), ticks(half[v]), indexing="ij")
        corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
        for side in (1, -1):
            face = np.empty((grid[0].size, 3))
            face[:, axis] = side * half[axis]
            face[:, u], face[:, v] = grid[0].ravel(), grid[1].ravel()
            points.append(face)
            quad = np.stack([corner, corner + cells + 1, corner + cells + 2, corner + 1], 1) + first
            quad = quad[:, ::side]
            faces += [quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]]
            first += len(face)
    box = np.concatenate(points)
    inner = np.clip(box, EDGE - half, half - EDGE)
    out = box - inner
    box = inner + EDGE * out / np.linalg.norm(out, axis=1, keepdims=True)
    radius, angle = RADIUS + box[:, 0], box[:, 1] / RADIUS
    bent = np.stack([radius * np.cos(angle) - RADIUS, radius * np.sin(angle), box[:, 2]], 1)
    return Mesh(bent, _welded(bent, np.concatenate(faces)))


def _welded(points: FloatArray, faces: IntArray) -> IntArray:
    """Faces over the first of each set of equal points, without the degenerate ones."""
    _, first, inverse = np.unique(points.round(9), axis=0, return_index=True, return_inverse=True)
    faces = first[inverse.ravel()[faces]]
    a, b, c = faces.T
    kept: IntArray = faces[(a != b) & (b != c) & (a != c)]
    return kept


def cloud(count: int, *, triangles: bool, extent: float = 100.0) -> SceneGraph:
    """S4: randomly turned and stretched spheres, or 1 280-triangle meshes, in a cube."""
    child: Node = icosphere(3) if triangles else SPHERE
    return SceneGraph(_scattered(child, count, extent, 0.25, 0.75, 4), "cloud")


def nested() -> SceneGraph:
    """S5: 1000 instances of 1000 instances of 1000 instances of an 80-triangle mesh."""
    leaf: Node = icosphere(1)
    for level in (2, 1):
        leaf = _scattered(leaf, 1000, 1.0, 0.025, 0.075, 50 + level)
    return SceneGraph(_scattered(leaf, 1000, 10.0, 0.25, 0.75, 50), "nested")


def rough_ball(cells: int = 725) -> SceneGraph:
    """One mesh of 2·cells² triangles (1 051 250): a ball with waves, open at two points."""
    u, v = np.mgrid[0 : cells + 1, 0 : cells + 1] / cells
    azimuth, polar = 2 * np.pi * u, np.pi * (0.001 + 0.998 * v)
    radius = 10 * (1 + 0.05 * np.sin(9 * azimuth) * np.sin(7 * polar) + 0.01 * np.sin(97 * polar))
    points = radius[..., None] * np.stack(
        [np.sin(polar) * np.cos(azimuth), np.cos(polar), np.sin(polar) * np.sin(azimuth)], -1
    )
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    quad = np.stack([corner, corner + 1, corner + cells + 2, corner + cells + 1], 1)
    faces = np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])
    return SceneGraph(Mesh(points.reshape(-1, 3), faces), "rough ball")


SOUP: tuple[Node, ...] = (
    SPHERE,
    Shape(ShapeKind.BOX, (-1.0, -0.6, -0.8, 1.0, 0.6, 0.8, 0.15)),
    Shape(ShapeKind.BOX, (-0.7, -0.7, -0.7, 0.7, 0.7, 0.7, 0.0)),
    Shape(ShapeKind.CYLINDER, (0.8, -0.9, 0.9, 0.2)),
    Shape(ShapeKind.CONE, (0.9, 1.6, 0.1)),
    Shape(ShapeKind.TORUS, (0.8, 0.3)),
    Shape(ShapeKind.RING, (0.5, 1.0, -0.4, 0.4, 0.1)),
    Shape(ShapeKind.WEDGE, (0.5, 1.2, -0.5, 0.5, 0.0, 110.0, 0.1)),
    Shape(ShapeKind.DISC, (1.0,)),
    Shape(ShapeKind.RECTANGLE, (1.4, 1.0)),
    Shape(ShapeKind.TRIANGLE, (-1.0, 0.0, -1.0, 1.0, 0.2, -0.6, 0.0, 0.0, 1.0)),
)


def soup(count: int = 550) -> SceneGraph:
    """As many instances of every shape, some with bevels, at random in a cube."""
    each = count // len(SOUP)
    parts = (_scattered(shape, each, 10.0, 0.3, 0.9, 70 + i) for i, shape in enumerate(SOUP))
    return SceneGraph(Group(tuple(parts)), "soup")


def icosphere(subdivisions: int) -> Mesh:
    """A unit sphere of 20·4ⁿ triangles."""
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=1.0)
    return Mesh(np.array(mesh.vertices, float), np.array(mesh.faces, np.int64))


def _scattered(
    child: Node, count: int, extent: float, low: float, high: float, seed: int
) -> Instances:
    """Instances at random: uniform rotation, scale in [low, high] per axis, in a cube."""
    random = np.random.default_rng(seed)
    w, x, y, z = _unit(random.normal(size=(count, 4))).T
    rotation = np.stack(
        [
            1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
        ],
        1,
    ).reshape(-1, 3, 3)  # fmt: skip
    scale = random.uniform(low, high, (count, 3))
    matrix = np.zeros((count, 3, 4))
    matrix[:, :, :3] = rotation * scale[:, None, :]
    matrix[:, :, 3] = random.uniform(-extent, extent, (count, 3))
    return Instances(child, Transform((Step(StepKind.MATRIX, matrix.reshape(count, 12)),)))


def _unit(vectors: FloatArray) -> FloatArray:
    """Vectors of length 1 along the last axis."""
    unit: FloatArray = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return unit


def _step(kind: StepKind, *values: float) -> Step:
    return Step(kind, np.array(values, float))


def _turn(axis: tuple[float, float, float], degrees: FloatArray) -> Step:
    """A batch of rotations about one axis."""
    axes = np.broadcast_to(np.array(axis, float), (len(degrees), 3))
    return Step(StepKind.ROTATE, np.concatenate([axes, degrees[:, None]], 1))
