"""The text form: canonical, readable, and read back to the same bits."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from compiler.flatten import flatten
from compiler.ir import COLUMNS, SceneIR
from compiler.ir_binary import content_hash
from compiler.ir_parse import parse_ir
from compiler.ir_text import print_ir
from compiler.validate import validate
from dsl.diagnostics import CompileError
from dsl.scene import (
    AreaLight,
    Bind,
    Camera,
    Group,
    Instances,
    Material,
    Mesh,
    Node,
    PointLight,
    SceneGraph,
    Settings,
    Shape,
    ShapeKind,
    Shaping,
    Sky,
    Step,
    StepKind,
    Sun,
    Transform,
)
from dsl.spans import Span
from tests.compiler.graphs import ball, graphs, origin, placed, step

APPEARANCE = Group(
    (
        Sun((0.1, -1, 0.3), (3, 2.5, 1e-300), 0.53),
        PointLight((1, 2, 3), (4, 5, 6), 0.25),
        Sky((0.1, 0.2, 0.3)),
        PointLight((0, 0, 0), (1, 1, 1), direction=(0, 3, 4), shaping=Shaping(30, 0.5, 2)),
        AreaLight("disc", (1, 2, 3), ((1, 0, 0), (0, 0.5, 0), (0, 0, -1)), (1, 2, 3), Shaping(60)),
        placed(
            Camera("perspective", 0.7, 1.5, (0.25, 0), 0.1, 1e5, 'the "front"'),
            step("translate", 0, 0, 9),
        ),
        Camera("orthographic", 3),
        Settings(640, 480, 16, "ids", "float64", 2.5, -0.5, "z"),
    )
)


def flat(root: Node) -> SceneIR:
    ir = flatten(SceneGraph(root), lambda file: (None, [])).ir
    assert ir is not None
    return ir


def assert_same(a: SceneIR, b: SceneIR) -> None:
    for name in COLUMNS:
        one, other = getattr(a, name), getattr(b, name)
        assert one.dtype == other.dtype, name
        assert one.shape == other.shape, name
        assert one.tobytes() == other.tobytes(), name


@given(graphs())
@settings(max_examples=60)
def test_text_reads_back_to_the_same_bits(root: Node) -> None:
    ir = flat(Group((root, APPEARANCE)))
    assert_same(parse_ir(print_ir(ir, sources=True)), ir)
    without = parse_ir(print_ir(ir))
    assert content_hash(without) == content_hash(ir)
    assert print_ir(without) == print_ir(ir)


@given(
    st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=3),
    st.lists(st.floats(0.01, 100), min_size=3, max_size=3),
    st.floats(-360, 360),
)
@example([0.0, 289263.0042300327, -1.1715218342273312e-95], [1.0, 28.0, 3.0], 0.0)
def test_any_placement_reads_back_to_the_same_bits(
    shift: list[float], scale: list[float], angle: float
) -> None:
    ir = flat(
        placed(
            ball(),
            step("translate", *shift),
            step("rotate", 1, 2, 3, angle),
            step("scale", *scale),
            step("translate", *reversed(shift)),
        )
    )
    assert_same(parse_ir(print_ir(ir, sources=True)), ir)


def test_groups_meshes_and_all_shapes_read_back() -> None:
    shapes: list[Node] = [
        Shape(ShapeKind.TORUS, (1.0, 0.25)),
        Shape(ShapeKind.PLANE, ()),
        Shape(ShapeKind.WEDGE, (0.5, 1.0, 0.0, 1.0, -30.0, 30.0, 0.0625)),
        Shape(ShapeKind.TRIANGLE, (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)),
        Mesh(np.array([[0.1, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2], [2, 1, 0]])),
    ]
    node: Node = Group(tuple(shapes))
    for level in range(3):
        shifts = np.random.default_rng(level).normal(size=(200, 3))
        node = Instances(node, Transform((Step(StepKind.TRANSLATE, shifts),)))
        node = Bind(node, Material(roughness=level / 4), override=level == 1)
    ir = flat(node)
    assert len(ir.group_ranges) > 1
    assert_same(parse_ir(print_ir(ir, sources=True)), ir)


def test_the_form() -> None:
    box = Shape(ShapeKind.BOX, (-1.0, 0.0, -1.0, 1.0, 2.0, 1.0, 0.1))
    ir = flat(
        Group(
            (
                placed(ball(), step("translate", 3, 0, 0), label="b"),
                Bind(placed(box, step("rotate", 0, 1, 0, 90)), Material((0.8, 0.55, 0.4))),
                placed(ball(), step("rotate", 0, 0, 1, 30), step("scale", 1, 2, 1)),
                ball(),
                Sun((0, -2, 0), (3, 3, 3)),
                Camera("perspective", 0.75, name="main"),
                Settings(width=640),
            )
        )
    )
    assert (
        print_ir(ir)
        == """\
ovolo ir 1
prototypes
  sphere 0: radius 1
  box 1: x0 -1 y0 0 z0 -1 x1 1 y1 2 z1 1 bevel 0.1
materials
  1: diffuse 0.8 0.55 0.4
instances
  sphere 0 [1 0 0 3 | 0 1 0 0 | 0 0 1 0]
  box 1 material 1 [0 0 1 0 | 0 1 0 0 | -1 0 0 0]
  sphere 0 [0.8660254037844386 -0.5 0 0 | 1 1.7320508075688772 0 0 | 0 0 1 0] \
inverse [0.8660254037844386 0.25 0 0 | -0.5 0.4330127018922193 0 0 | 0 0 1 0]
  sphere 0
lights
  sun direction 0 -1 0 irradiance 3 3 3
cameras
  perspective "main" height 0.75
settings
  width 640
"""
    )


def test_the_empty_scene_is_one_line() -> None:
    text = print_ir(flat(Group(())))
    assert text == "ovolo ir 1\n"
    assert_same(parse_ir(text), flat(Group(())))


HEAD = "ovolo ir 1\n"
SPHERE = HEAD + "prototypes\n  sphere 0: radius 1\n"


@pytest.mark.parametrize(
    ("text", "words", "message"),
    [
        ("", "", "the text is empty, it is no scene"),
        ("ovolo ir 2", "", "this is not version 1 of the form"),
        ("hello", "hello", "expected `ovolo`"),
        (HEAD + "things\n", "things", "expected the title of a section"),
        (HEAD + "  sphere 0\n", "sphere", "this line belongs to no section"),
        (HEAD + "prototypes\n  sphere 1: radius 1\n", "radius", "numbered in order"),
        (HEAD + "prototypes\n  ball 0: radius 1\n", "ball", "expected a kind of shape"),
        (HEAD + "prototypes\n  sphere 0: radius 1_0\n", "1_0", "expected a number"),
        (HEAD + "prototypes\n  sphere 0: radius 1 2\n", "2", "nothing more is expected"),
        (HEAD + "prototypes\n  mesh 0\n    face 0 1 x\n", "x", "expected an integer"),
        (HEAD + "prototypes\n  point 0 0 0\n", "point", "belongs to no mesh"),
        (SPHERE + "instances\n  box 0\n", "", "there is no prototype `box 0`"),
        (SPHERE + "instances\n  sphere 0 [1 0 0\n", "", "expected a number"),
        (SPHERE + "group 1\n", "", "groups are numbered in order"),
        (HEAD + "materials\n  3: ior 2\n", "ior", "materials are numbered in order"),
        (HEAD + "lights\n  lamp\n", "lamp", "expected a kind of light"),
        (HEAD + "lights\n  sky\n", "", "expected `radiance`"),
        (HEAD + "settings\n  precision half\n", "half", "expected one of float32, float64"),
        (HEAD + "settings\n  width -3\n", "-3", "outside of 0"),
        (HEAD + 'cameras\n  perspective "\n', '"', "expected a quoted text"),
    ],
)
def test_faulty_text_says_where(text: str, words: str, message: str) -> None:
    with pytest.raises(CompileError) as caught:
        parse_ir(text)
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.code == "ir-syntax"
    assert message in diagnostic.message
    if diagnostic.primary:
        place = diagnostic.primary.place
        assert isinstance(place, Span)
        assert text.encode()[place.start : place.end].decode() == words


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (SPHERE + "instances\n  group 4\n", "a group that is not there"),
        (SPHERE + "instances\n  group 0\n", "group 0 contains itself"),
        (SPHERE + "instances\n  group 1\ngroup 1\n  group 1\n", "group 1 contains itself"),
        (SPHERE + "instances\n  sphere 0 material 7\n", "a material that is not there"),
        (SPHERE + "instances\n  sphere 0 [1 0 0 inf | 0 1 0 0 | 0 0 1 0]\n", "not finite"),
        (SPHERE + "instances\n  sphere 0 [0 0 0 0 | 0 1 0 0 | 0 0 1 0]\n", "not finite"),
        (SPHERE + "instances\n  sphere 0 source 0\n", "a source that is not there"),
        (HEAD + "prototypes\n  sphere 0: radius -1\n", "not greater than 0"),
        (HEAD + "prototypes\n  box 0: x0 0 y0 0 z0 0 x1 1 y1 1 z1 1 bevel 0.6\n", "exceeds"),
        (HEAD + "prototypes\n  mesh 0\n    face 0 1 2\n", "points that are not there"),
        (HEAD + "cameras\n  perspective height 0\n", "no extent"),
        (HEAD + "lights\n  point position 0 0 0 intensity 1 1 1 cone 30\n", "has no direction"),
        (HEAD + "sources\n  0: origin 0\n", "an origin that is not there"),
    ],
)
def test_contradictory_text_is_refused(text: str, message: str) -> None:
    with pytest.raises(CompileError) as caught:
        parse_ir(text)
    assert {d.code for d in caught.value.diagnostics} == {"ir-invalid"}
    assert message in caught.value.diagnostics[0].message


def test_several_faults_are_reported_at_once_but_not_without_end() -> None:
    with pytest.raises(CompileError) as caught:
        parse_ir(HEAD + "instances\n" + "  nothing\n" * 3)
    assert len(caught.value.diagnostics) == 3
    with pytest.raises(CompileError) as caught:
        parse_ir(HEAD + "instances\n" + "  nothing\n" * 300)
    assert len(caught.value.diagnostics) == 20


@given(st.text(alphabet='ovl ir1\n[]|:"0.e-sphgu', max_size=80))
def test_no_text_does_worse_than_diagnostics(text: str) -> None:
    for whole in (text, HEAD + text, SPHERE + "instances\n  " + text):
        with suppress(CompileError):
            assert validate(parse_ir(whole)) == []


def test_sources_are_printed_only_when_asked_for() -> None:
    ir = flat(placed(ball(), label="loop"))
    assert "loop" not in print_ir(ir)
    assert print_ir(flat(Shape(ShapeKind.SPHERE, (1.0,), origin("other")))) == print_ir(ir)
    assert 'label "loop" "scene.ovo" 0 1' in print_ir(ir, sources=True)
