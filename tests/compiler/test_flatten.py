"""Flattening against plain recursion, and its rules one by one."""

from __future__ import annotations

from functools import reduce

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from compiler import expand
from compiler.affine import Affine
from compiler.compilation import compile_text
from compiler.flatten import Flattened, flatten
from compiler.ir import COLUMNS, SceneIR, leaf_counts
from compiler.provenance import object_path, source_place
from compiler.transforms import compose
from compiler.validate import validate
from dsl.diagnostics import Diagnostic
from dsl.scene import (
    DEFAULT_MATERIAL,
    Bind,
    Camera,
    File,
    Group,
    Instances,
    Material,
    Mesh,
    Node,
    Origin,
    PointLight,
    SceneGraph,
    Settings,
    Shape,
    ShapeKind,
    Sky,
    Step,
    StepKind,
    Sun,
    Transform,
)
from dsl.spans import PrimPlace, Span
from tests.compiler.graphs import (
    MATERIALS,
    SOURCE,
    ball,
    graphs,
    leaves,
    origin,
    placed,
    rows,
    step,
)

RED, BLUE = Material((1, 0, 0)), Material((0, 0, 1))


def no_files(file: File) -> tuple[Node | None, list[Diagnostic]]:
    raise AssertionError(file)


def flat(root: Node) -> SceneIR:
    result = flatten(SceneGraph(root), no_files)
    assert result.diagnostics == []
    assert result.ir is not None
    assert validate(result.ir) == []
    return result.ir


def flattened(*items: Node) -> Flattened:
    return flatten(SceneGraph(Group(items)), no_files)


def rounded(affine: Affine) -> np.ndarray:
    out = np.empty((1, 3, 4))
    affine.round_into(out)
    return np.asarray(out[0])


def check(ir: SceneIR, root: Node) -> None:
    """`ir` holds the leaves of `root`: order, shapes, materials, places, paths."""
    expected, found = leaves(root), rows(ir)
    assert [leaf.shape for leaf in expected] == [shape for shape, _, _ in found]
    assert [leaf.material for leaf in expected] == [material for _, _, material in found]
    for leaf, (_, matrix, _) in zip(expected, found, strict=True):
        exact = rounded(compose(leaf.steps).forward)
        size = reduce(
            np.multiply,
            (np.linalg.norm(rounded(compose([s]).forward)) for s in leaf.steps),
            1.0,
        )
        assert np.abs(matrix[:3] - exact).max() <= 1e-14 * size
    assert [object_path(ir, i) for i in range(len(expected))] == [leaf.path for leaf in expected]


@given(graphs())
@settings(max_examples=60)
def test_any_graph_is_flattened_to_what_it_denotes(root: Node) -> None:
    check(flat(root), root)


@given(graphs())
@settings(max_examples=60)
def test_kept_groups_denote_the_same(root: Node) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(expand, "FLATTEN_LEAVES", 0)
        patch.setattr(expand, "FLATTEN_ROWS", 0)
        kept = flat(root)
    check(kept, root)
    assert leaf_counts(kept)[0] == len(leaves(root))


@given(graphs())
@settings(max_examples=60)
def test_inverses_are_inverses(root: Node) -> None:
    ir = flat(root)
    for forward, inverse in zip(ir.world_from_object, ir.object_from_world, strict=True):
        one = inverse[:, :3] @ forward[:, :3]
        size = np.linalg.norm(forward[:, :3]) * np.linalg.norm(inverse[:, :3])
        assert np.abs(one - np.eye(3)).max() <= 1e-15 * size
        back = inverse[:, :3] @ forward[:, 3] + inverse[:, 3]
        assert np.abs(back).max() <= 1e-14 * np.linalg.norm(inverse[:, :3]) * np.linalg.norm(
            forward[:, 3]
        )


@given(st.integers(2, 40), st.booleans())
@settings(max_examples=20)
def test_a_batch_and_a_loop_give_the_same_arrays(count: int, nested: bool) -> None:
    random = np.random.default_rng(count)
    child: Node = placed(ball(), step("scale", 1, 4, 1), step("translate", 0, 10, 0))
    if nested:
        child = Group((child, placed(ball(2.0), step("rotate", 1, 2, 3, 40))))
    turns = np.column_stack([np.zeros((count, 2)), np.ones(count), random.uniform(0, 360, count)])
    shifts = random.normal(size=(count, 3))
    batch = Instances(
        child, Transform((Step(StepKind.ROTATE, turns), Step(StepKind.TRANSLATE, shifts)))
    )
    loop = Group(
        tuple(
            placed(child, Step(StepKind.ROTATE, turns[i]), Step(StepKind.TRANSLATE, shifts[i]))
            for i in range(count)
        )
    )
    one, other = (
        flat(placed(batch, step("shear", 0, 3, 0, 0, 0, 0))),
        flat(placed(loop, step("shear", 0, 3, 0, 0, 0, 0))),
    )
    for name in COLUMNS:
        if not name.startswith(("source", "instance_source")):
            assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name


def test_a_batch_of_a_group_goes_by_index_then_by_item() -> None:
    pair = Group((ball(1.0), ball(2.0)))
    shifts = np.array([[1.0, 0, 0], [2, 0, 0]])
    ir = flat(Instances(pair, Transform((Step(StepKind.TRANSLATE, shifts),))))
    assert ir.instance_target.tolist() == [0, 1, 0, 1]
    assert ir.world_from_object[:, 0, 3].tolist() == [1, 1, 2, 2]


def test_equal_shapes_are_one_prototype() -> None:
    ir = flat(Group((ball(1.0), ball(1.0), ball(2.0), ball(-0.0 + 1.0))))
    assert ir.instance_target.tolist() == [0, 0, 1, 0]
    assert flattened(ball(), ball()).pruned.equal_shapes == 1


def test_a_mesh_is_stored_once_and_an_empty_one_not_at_all() -> None:
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]]))
    empty = Mesh(np.eye(3), np.empty((0, 3), dtype=np.int64))
    ir, _, pruned = flattened(mesh, placed(mesh, step("translate", 1, 0, 0)), empty)
    assert ir is not None
    assert len(ir.mesh_points) == 3
    assert ir.instance_target.tolist() == [0, 0]
    assert pruned.empty_meshes == 1


def test_files_are_read_once_and_their_faults_reported() -> None:
    asked = []

    def load(file: File) -> tuple[Node | None, list[Diagnostic]]:
        asked.append(file.path)
        if file.path == "missing.obj":
            return None, [Diagnostic("file-missing", "error", "no file")]
        return ball(), []

    found = File("mesh", "a.obj"), File("mesh", "a.obj")
    result = flatten(SceneGraph(Group(found)), load)
    assert result.ir is not None
    assert asked == ["a.obj"]
    assert len(result.ir.instance_target) == 2
    result = flatten(SceneGraph(Group((*found, File("mesh", "missing.obj")))), load)
    assert result.ir is None
    assert [d.code for d in result.diagnostics] == ["file-missing"]


@pytest.mark.parametrize(
    ("root", "material"),
    [
        (ball(), DEFAULT_MATERIAL),
        (Bind(ball(), RED), RED),
        (Bind(Bind(ball(), RED), BLUE), RED),
        (Bind(Bind(ball(), RED), BLUE, override=True), BLUE),
        (Bind(Bind(ball(), RED, override=True), BLUE), RED),
        (Bind(Bind(ball(), RED, override=True), BLUE, override=True), BLUE),
        (Bind(Bind(Bind(ball(), RED), BLUE, override=True), RED), BLUE),
    ],
)
def test_the_innermost_material_wins_unless_one_overrides(root: Node, material: Material) -> None:
    ((_, _, found),) = rows(flat(root))
    assert found == material
    assert len(flat(root).materials) == 1


def test_the_default_material_is_there_only_if_needed() -> None:
    assert len(flat(Bind(ball(), RED)).materials) == 1
    ir = flat(Group((Bind(ball(), RED), ball())))
    assert ir.materials["diffuse"].tolist() == [list(DEFAULT_MATERIAL.diffuse), [1, 0, 0]]
    assert ir.instance_material.tolist() == [1, -1]
    assert flattened(Bind(Bind(ball(), RED), BLUE, override=True)).pruned.unused_materials == 1


def test_shared_groups_are_kept_where_flattening_would_cost_too_much() -> None:
    node: Node = ball()
    for level in range(3):
        shifts = np.random.default_rng(level).normal(size=(1000, 3))
        transform = Transform((Step(StepKind.TRANSLATE, shifts),))
        node = Instances(node, transform, origin=origin(f"level{level}"))
    ir = flat(node)
    assert np.diff(ir.group_ranges).ravel().tolist() == [1000, 1000, 1000]
    assert leaf_counts(ir)[0] == 10**9
    assert ir.nbytes < 1e6
    assert object_path(ir, 123_456_789) == "level2[123]/level1[456]/level0[789]/ball"


def test_small_groups_are_flattened_into_large_ones() -> None:
    flower = Group(tuple(placed(ball(), step("translate", i, 0, 0)) for i in range(5)))
    field = Instances(flower, Transform((Step(StepKind.TRANSLATE, np.zeros((1000, 3))),)))
    land = Instances(field, Transform((Step(StepKind.TRANSLATE, np.zeros((1000, 3))),)))
    assert np.diff(flat(land).group_ranges).ravel().tolist() == [1000, 5000]


def test_a_doubling_tower_is_counted_and_limited() -> None:
    node: Node = ball()
    for _ in range(39):
        node = Group((node, placed(node, step("translate", 1, 0, 0))))
    assert leaf_counts(flat(node))[0] == 2**39
    for _ in range(60):
        node = Group((node, placed(node, step("translate", 1, 0, 0))), origin("tower", start=3))
    result = flatten(SceneGraph(node), no_files)
    assert result.ir is None
    assert [d.code for d in result.diagnostics] == ["scene-too-many-instances"]


def test_lights_and_cameras_are_placed_and_the_sky_is_not() -> None:
    mirror = Step(StepKind.SCALE, np.array([-2.0, 2, 2]))
    ir, _, pruned = flattened(
        placed(
            Group(
                (
                    Sun((3, -4, 0), (1, 1, 1), 0.5),
                    PointLight((1, 2, 3), (1, 1, 1), 0.5),
                    Sky((0.1, 0.1, 0.1)),
                    Sun((1, 0, 0), (0, 0, 0)),
                    Camera("orthographic", 3, near=1, name="front"),
                    Camera("perspective", 3, aspect=1.5),
                )
            ),
            mirror,
            step("translate", 10, 0, 0),
        )
    )
    assert ir is not None
    assert ir.lights["kind"].tolist() == [0, 1, 2]
    assert ir.lights["vector"][:2].tolist() == [[-0.6, -0.8, 0], [8, 4, 6]]
    assert ir.lights["size"].tolist() == pytest.approx([0.5, 1.0, 0.0])
    assert pruned.dark_lights == 1
    front, back = ir.cameras
    assert front["height"] == 6
    assert front["near"] == 2
    assert ir.text(int(front["name"])) == "front"
    assert back["height"] == 3
    assert back["aspect"] == 1.5
    assert back["world_from_camera"].tolist() == [[-1, 0, 0, 10], [0, 1, 0, 0], [0, 0, 1, 0]]


def test_settings_hold_as_said_last() -> None:
    ir = flat(Group((Settings(width=1, samples=3), placed(Settings(width=2, up="z")))))
    (record,) = ir.settings
    assert record["width"] == 2
    assert record["samples"] == 3
    assert record["height"] == 0
    assert record["up"] == 1
    assert record["integrator"] == -1


def test_singular_instances_are_left_out_and_the_others_keep_their_paths() -> None:
    scales = np.array([[1.0, 1, 1], [0, 1, 1], [2, 2, 2], [1, 0, 0]])
    batch = Instances(
        ball(), Transform((Step(StepKind.SCALE, scales),)), origin=origin("b", start=5)
    )
    result = flattened(
        batch, placed(ball(), step("scale", 1e200, 1, 1), step("scale", 1e200, 1, 1))
    )
    ir = result.ir
    assert ir is not None
    assert validate(ir) == []
    assert [object_path(ir, i) for i in range(2)] == ["b[0]/ball", "b[2]/ball"]
    assert len(ir.instance_target) == 2
    assert result.pruned.singular_instances == 3
    assert {d.code for d in result.diagnostics} == {"scene-singular-transform"}
    assert {d.severity for d in result.diagnostics} == {"warning"}
    assert "2 instances" in result.diagnostics[0].message


def test_groups_left_without_leaves_vanish() -> None:
    pair = Group((placed(ball(), step("scale", 0, 1, 1)), placed(ball(), step("scale", 1, 0, 1))))
    twice = Group((placed(pair, step("translate", 1, 0, 0)), pair, ball(3.0)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(expand, "FLATTEN_LEAVES", 0)
        patch.setattr(expand, "FLATTEN_ROWS", 0)
        ir = flatten(SceneGraph(twice), no_files).ir
    assert ir is not None
    assert validate(ir) == []
    assert ir.instance_target.tolist() == [0]
    assert ir.shape_parameters.tolist() == [3.0]


@pytest.mark.parametrize("root", [Group(()), Group((Group(()), Settings()))])
def test_empty_scenes_are_scenes(root: Node) -> None:
    ir = flat(root)
    assert ir.group_ranges.tolist() == [[0, 0]]
    assert leaf_counts(ir).tolist() == [0]


def test_a_chain_of_100000_nodes_is_one_instance() -> None:
    node: Node = ball()
    for _ in range(100_000):
        node = placed(node, step("translate", 1, 0, 0))
    ir = flat(node)
    assert ir.world_from_object[0, :, 3].tolist() == [100_000, 0, 0]


def test_a_nest_of_20000_groups_is_flattened() -> None:
    node: Node = ball()
    for _ in range(20_000):
        node = Group((ball(), placed(node, step("translate", 1, 0, 0))))
    ir = flat(node)
    assert ir.world_from_object[:, 0, 3].tolist() == [*range(20_000), 20_000]


def test_a_long_shared_chain_is_composed_for_all_its_users() -> None:
    shared: Node = ball()
    for _ in range(5_000):
        shared = placed(shared, step("translate", 1, 0, 0))
    ir = flat(Group(tuple(placed(shared, step("scale", i, 1, 1)) for i in range(1, 200))))
    assert ir.world_from_object[:, 0, 3].tolist() == [5000 * i for i in range(1, 200)]


def test_a_million_instances_are_a_million_rows_of_at_most_216_bytes() -> None:
    count = 10**6
    random = np.random.default_rng(0)
    steps = (
        Step(StepKind.TRANSLATE, random.normal(size=(count, 3))),
        Step(StepKind.SCALE, random.uniform(1, 2, (count, 3))),
    )
    ir = flat(Instances(ball(), Transform(steps), origin=origin("grain")))
    assert len(ir.instance_target) == count
    assert ir.translation_low.any()
    assert ir.nbytes <= 216 * count + 1000
    assert object_path(ir, 777_777) == "grain[777777]/ball"


def test_translation_low_is_what_rounding_left_out() -> None:
    ir = flat(placed(ball(), step("translate", 1e12, 0, 0), step("translate", 0.1, 0, 0)))
    exact = 0.1
    high = float(ir.world_from_object[0, 0, 3])
    assert high + float(ir.translation_low[0, 0]) == high
    assert (high - 1e12) + float(ir.translation_low[0, 0]) == pytest.approx(exact, abs=1e-12)
    assert len(flat(ball()).translation_low) == 0


def test_every_material_of_the_tests_is_distinct() -> None:
    assert len(set(MATERIALS)) == len(MATERIALS)
    root = Group(tuple(Bind(ball(), m) for m in MATERIALS))
    assert len(flat(root).materials) == len(MATERIALS)
    assert Shape(ShapeKind.SPHERE, (1.0,)) != Shape(ShapeKind.SPHERE, (1.0,))


def test_point_instancers_come_last_in_a_path_innermost_first() -> None:
    def prim(path: str, point: bool = False) -> Origin:
        return Origin(PrimPlace("stage.usda", path), path, point=point)

    shifts = Transform((Step(StepKind.TRANSLATE, np.zeros((3, 3))),))
    leaf = Shape(ShapeKind.SPHERE, (1.0,), prim("/Tree/leaf"))
    inner = Instances(leaf, shifts, origin=prim("/Tree/Leaves", point=True))
    outer = Instances(inner, shifts, origin=prim("/Trees", point=True))
    ir = flat(Group((outer,), prim("/Car")))
    assert object_path(ir, 5) == "/Car/Tree/leaf@/Car/Tree/Leaves[2]@/Car/Trees[1]"
    assert source_place(ir, 5, {}) == PrimPlace("stage.usda", "/Tree/leaf")


def test_places_are_those_of_the_innermost_name() -> None:
    nameless = Shape(ShapeKind.SPHERE, (1.0,), origin("", start=42))
    items = placed(nameless, label="b"), nameless, Shape(ShapeKind.SPHERE, (1.0,))
    ir = flat(Group(items))
    assert source_place(ir, 0, {SOURCE.name: SOURCE.text}) == Span(SOURCE, 0, 1)
    assert source_place(ir, 1, {SOURCE.name: SOURCE.text}) == Span(SOURCE, 42, 43)
    assert source_place(ir, 2, {}) is None
    assert [object_path(ir, i) for i in range(3)] == ["b", "", ""]
    with pytest.raises(IndexError, match="there is no instance 3"):
        object_path(ir, 3)


def test_equal_groups_become_one_where_groups_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """A function called again makes its group again; what differs in a bit stays apart."""
    monkeypatch.setattr(expand, "FLATTEN_LEAVES", 1000)
    monkeypatch.setattr(expand, "FLATTEN_ROWS", 10)
    text = """
    fn tree(size) { for i in 0..50 { sphere().translate(i, 0, size) } }
    fn grove() { for i in 0..20 { tree(1).translate(0, i, 0) } }
    for i in 0..10 { grove().translate(0, 0, 200 * i) }
    tree(1)
    tree(2).translate(0, 0, 9)
    """
    ir = compile_text(text).ir
    assert leaf_counts(ir)[0] == 10 * 20 * 50 + 100
    assert len(ir.group_ranges) == 3
    assert len(ir.instance_target) == (10 + 1 + 50) + 20 + 50
    assert object_path(ir, 10_000 - 1) == "grove[9]/tree[19]/sphere[49]"
