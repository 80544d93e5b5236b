"""What a caller chooses of a stage: purposes, masks, variants; and how a hostile one is held."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import ovolo
from compiler.compilation import compile_text
from compiler.usd import Isolation, StageOptions, import_stage
from dsl.diagnostics import CompileError
from dsl.files import Files
from ovolo.__main__ import main
from ovolo.exits import Exit

Load = Callable[..., Any]

CAR = """
def Xform "World" {
    def Xform "Car" (
        variants = { string color = "red" }
        prepend variantSets = "color"
    ) {
        variantSet "color" = {
            "red" {
                def Sphere "red" {
                }
            }
            "blue" {
                def Cube "blue" {
                }
            }
        }
    }
    def Sphere "Other" (prepend apiSchemas = ["MaterialBindingAPI"]) {
        rel material:binding = </Looks/m>
    }
    def Cube "Proxy" {
        uniform token purpose = "proxy"
    }
}
def Scope "Looks" {
    def Material "m" {
        token outputs:surface.connect = </Looks/m/s.outputs:surface>
        def Shader "s" {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (1, 0, 0)
            token outputs:surface
        }
    }
}
"""


def test_variants_are_selected(load: Load) -> None:
    assert "/World/Car/red" in load(CAR).paths()
    imported = load(CAR, variants=("/World/Car{color=blue}",))
    assert imported.diagnostics == []
    assert "/World/Car/blue" in imported.paths()
    assert "/World/Car/red" not in imported.paths()


@pytest.mark.parametrize(
    ("variant", "code", "words", "help"),
    [
        ("/World/Car{color=bleu}", "usd-variant", "no variant `bleu`", "did you mean `blue`?"),
        ("/World/Car{colour=blue}", "usd-variant", "variant set `colour`", "did you mean `color`?"),
        ("/World/Bike{color=blue}", "usd-prim", "no prim `/World/Bike`", None),
        ("/World/Car", "usd-variant", "selects no variant", "write it as `/World/Car{color=red}`"),
        ("blue", "usd-variant", "selects no variant", "write it as `/World/Car{color=red}`"),
    ],
)
def test_variants_that_are_not_there_are_errors(
    load: Load, variant: str, code: str, words: str, help: str | None
) -> None:
    (fault,) = load(CAR, variants=(variant,)).diagnostics
    assert (fault.code, fault.severity, fault.help) == (code, "error", help)
    assert words in fault.message


def test_a_mask_reads_what_it_names_and_what_that_is_bound_to(load: Load) -> None:
    imported = load(CAR, mask=("/World/Other",))
    assert imported.paths() == ["/World/Other"]
    assert imported.leaf("/World/Other").material.diffuse == (1, 0, 0)
    (fault,) = load(CAR, mask=("World Other",)).diagnostics
    assert (fault.code, fault.severity) == ("usd-prim", "error")


@pytest.fixture
def car(tmp_path: Path) -> Path:
    path = tmp_path / "car.usda"
    path.write_text(f"#usda 1.0\n{CAR}")
    return path


def paths(scene: ovolo.Scene) -> list[str]:
    return [scene.object_path(k) for k in range(len(scene.ir.instance_target))]


def test_python_chooses_as_the_command_line_does(car: Path) -> None:
    scene = ovolo.compile_file(
        car,
        purposes=["proxy"],
        mask=["/World"],
        variants=["/World/Car{color=blue}"],
        strict=True,
        isolate=True,
    )
    assert paths(scene) == ["/World/Car/blue", "/World/Other", "/World/Proxy"]
    assert paths(ovolo.compile_file(car, prim="/World/Other")) == ["/World/Other"]


def test_the_command_line_chooses(car: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--purposes", "proxy,guide", "--variant", "/World/Car{color=blue}"]
    assert main(["compile", str(car), *arguments, "--mask", "/World/Car,/World/Proxy"]) == Exit.OK
    assert capsys.readouterr().out.endswith("instances\n  box 0\n  box 0\n")
    assert main(["compile", str(car), "--purposes", "all"]) == Exit.USAGE
    program = car.with_suffix(".ovo")
    program.write_text("sphere()\n")
    assert main(["compile", str(program), "--prim", "/World"]) == Exit.USAGE


def test_strict_takes_drops_for_errors(car: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(car), "--strict"]) == Exit.OK
    car.write_text(f'#usda 1.0\n{CAR}def Volume "t" {{\n}}\n')
    assert main(["check", str(car)]) == Exit.OK
    capsys.readouterr()
    assert main(["check", str(car), "--strict"]) == Exit.FAULTS
    assert "error[usd-unsupported]" in capsys.readouterr().err
    with pytest.raises(CompileError):
        ovolo.compile_file(car, strict=True)


# Confinement.

OUTSIDE = {
    "sublayer": "(subLayers = [@{}@])",
    "reference": 'def "a" (references = @{}@) {{\n}}',
    "payload": 'def "a" (payload = @{}@) {{\n}}',
    "unselected variant": 'def "a" (prepend variantSets = "v") {{\nvariantSet "v" = {{\n"x" '
    "(references = @{}@) {{\n}}\n}}\n}}",
    "texture": 'def "a" {{\nasset inputs:file = @{}@\n}}',
    "texture at a time": 'def "a" {{\nasset inputs:file.timeSamples = {{ 1: @{}@ }}\n}}',
    "list of textures": 'def "a" {{\nasset[] files = [@{}@]\n}}',
    "clips": 'def "a" (clips = {{ dictionary default = {{ asset[] assetPaths = [@{}@] '
    "}} }}) {{\n}}",
    "clip template": 'def "a" (clips = {{ dictionary default = {{ string templateAssetPath = "{}" '
    "}} }}) {{\n}}",
}


@pytest.fixture
def rooms(tmp_path: Path) -> Path:
    """A folder that may be read, beside one that may not."""
    for name in ("in", "out"):
        (tmp_path / name).mkdir()
        for suffix in ("usda", "png"):
            (tmp_path / name / f"other.{suffix}").write_text('#usda 1.0\ndef Sphere "s" {\n}\n')
    return tmp_path


@pytest.mark.parametrize("kind", OUTSIDE)
@pytest.mark.parametrize("absolute", [False, True])
def test_what_a_stage_names_outside_of_its_root_is_refused(
    rooms: Path, kind: str, absolute: bool
) -> None:
    suffix = "png" if "texture" in kind else "usda"
    name = f"{rooms}/out/other.{suffix}" if absolute else f"../out/other.{suffix}"
    if kind == "clip template":
        name = name.replace("other", "other.#")
    stage = rooms / "in" / "stage.usda"
    stage.write_text("#usda 1.0\n" + OUTSIDE[kind].format(name))
    _, faults = import_stage(stage, options=StageOptions(root=rooms / "in"))
    assert "usd-outside" in [fault.code for fault in faults]
    assert name in faults[0].message
    inner = name.replace("../out", ".").replace("/out/", "/in/")
    stage.write_text("#usda 1.0\n" + OUTSIDE[kind].format(inner))
    _, faults = import_stage(stage, options=StageOptions(root=rooms / "in"))
    assert "usd-outside" not in [fault.code for fault in faults]


def test_layers_are_looked_at_however_far_they_are(rooms: Path) -> None:
    stage, middle = rooms / "in" / "stage.usda", rooms / "in" / "middle.usda"
    stage.write_text("#usda 1.0\n(subLayers = [@middle.usda@])\n")
    middle.write_text('#usda 1.0\ndef "a" (references = @../out/other.usda@</s>) {\n}\n')
    with pytest.raises(CompileError) as caught:
        ovolo.compile_file(stage, root=rooms / "in")
    assert caught.value.diagnostics[0].code == "usd-outside"
    assert "middle.usda" in caught.value.diagnostics[0].message
    (rooms / "in" / "link.usda").symlink_to(rooms / "out" / "other.usda")
    middle.write_text('#usda 1.0\ndef "a" (references = @link.usda@</s>) {\n}\n')
    with pytest.raises(CompileError):
        ovolo.compile_file(stage, root=rooms / "in")
    assert len(ovolo.compile_file(stage).ir.instance_target) == 1


def test_expressions_are_refused_under_a_root(rooms: Path) -> None:
    stage = rooms / "in" / "stage.usda"
    stage.write_text(
        '#usda 1.0\n(expressionVariables = { string V = "../out/other.usda" })\n'
        'def "a" (references = @`"${V}"`@</s>) {\n}\n'
    )
    _, faults = import_stage(stage, options=StageOptions(root=rooms / "in"))
    assert faults[0].code == "usd-outside"


def test_stages_of_programs_stay_in_the_root_too(rooms: Path) -> None:
    (rooms / "in" / "stage.usda").write_text("#usda 1.0\n(subLayers = [@../out/other.usda@])\n")
    with pytest.raises(CompileError) as caught:
        compile_text('usd("stage.usda")', "scene.ovo", Files(rooms / "in"))
    assert caught.value.diagnostics[0].code == "usd-outside"


# Isolation.


def test_a_child_gives_the_same_scene(car: Path) -> None:
    apart = ovolo.compile_file(car, deadline=100, memory_limit=4 << 30)
    here = ovolo.compile_file(car)
    assert paths(apart) == paths(here)
    assert [str(w) for w in apart.warnings] == [str(w) for w in here.warnings]


def test_graphs_deeper_than_the_stack_come_over(tmp_path: Path) -> None:
    from compiler.usd.transfer import from_bytes, to_bytes
    from dsl.scene import Group, Instances, Node, SceneGraph, Shape, ShapeKind, Transform

    ball: Node = Shape(ShapeKind.SPHERE, (1.0,))
    node: Node = Group((ball, ball))
    for _ in range(20_000):
        node = Instances(node, Transform())
    graph, _ = from_bytes(to_bytes(SceneGraph(node), []))
    below: Any = graph.root
    while isinstance(below, Instances):
        below = below.child
    assert below.items[0] is below.items[1]


def test_a_stage_that_takes_too_long_ends_at_the_deadline(car: Path) -> None:
    graph, (fault,) = import_stage(car, isolation=Isolation(seconds=0.01))
    assert (fault.code, fault.severity) == ("usd-deadline", "error")
    assert graph.root.items == ()  # type: ignore[union-attr]


def test_a_stage_at_which_usd_core_crashes_is_an_error(tmp_path: Path) -> None:
    depth = 100_000
    deep, stage = tmp_path / "in" / "deep.usda", tmp_path / "stage.usda"
    deep.parent.mkdir()
    deep.write_text("#usda 1.0\n" + 'def "a" {\n' * depth + "}\n" * depth)
    # A folder in a variable is not known before.
    variable = 'expressionVariables = { string V = "in/deep" }'
    stage.write_text(f'#usda 1.0\n(\n{variable}\nsubLayers = [@`"${{V}}.usda"`@]\n)\n')
    _, (fault,) = import_stage(stage, isolation=Isolation())
    assert (fault.code, fault.severity) == ("usd-crash", "error")


@pytest.mark.parametrize("way", ["subLayers", "references", "usdz"])
def test_layers_that_nest_too_deep_are_not_reached(tmp_path: Path, way: str) -> None:
    depth = 100_000
    deep, stage = tmp_path / "in" / "deep.usda", tmp_path / "stage.usda"
    deep.parent.mkdir()
    deep.write_text("#usda 1.0\n" + 'def "a" {\n' * depth + "}\n" * depth)
    if way == "subLayers":
        stage.write_text("#usda 1.0\n(\n    subLayers = [@./in/deep.usda@]\n)\n")
    elif way == "references":
        (deep.parent / "next.usda").write_text('#usda 1.0\ndef "b" (payload = @deep.usda@) {}\n')
        stage.write_text('#usda 1.0\ndef "a" (references = @in/next.usda@</b>) {}\n')
    else:
        stage = tmp_path / "stage.usdz"
        with zipfile.ZipFile(stage, "w") as package:
            package.write(deep, "deep.usda")
    _, (fault,) = import_stage(stage)
    assert (fault.code, fault.severity) == ("usd-open", "error")
    assert "5000 levels" in fault.message
    _, (fault, *_) = import_stage(stage, options=StageOptions(root=tmp_path))
    assert fault.severity == "error"


def test_no_memory_at_all_is_said_so_and_little_is_enough_for_little(tmp_path: Path) -> None:
    stage = tmp_path / "stage.usda"
    stage.write_text('#usda 1.0\ndef Sphere "ball" {}\n')
    _, (fault,) = import_stage(stage, isolation=Isolation(memory=1))
    assert fault.code == "usd-memory"
    assert fault.message == "the stage needs more than 1 byte to be imported"
    assert import_stage(stage, isolation=Isolation(memory=128 << 20))[1] == []


@pytest.mark.parametrize("opening", ['def "a" {', "{dictionary a = ", "(", "["])
def test_text_that_nests_too_deep_is_not_read(tmp_path: Path, opening: str) -> None:
    stage = tmp_path / "deep.usda"
    # The last levels are in another block than the first.
    stage.write_text(f"#usda 1.0\n{opening * 4000}{' ' * (1 << 23)}{opening * 4000}")
    _, (fault,) = import_stage(stage)
    assert (fault.code, fault.severity) == ("usd-open", "error")
    assert "5000 levels" in fault.message


def test_a_stage_that_needs_too_much_memory_is_an_error(tmp_path: Path) -> None:
    stage = tmp_path / "large.usda"
    stage.write_text(
        '#usda 1.0\ndef Points "p" {\npoint3f[] points = ['
        + ", ".join(["(1, 2, 3)"] * 1_000_000)
        + "]\n}\n"
    )
    _, faults = import_stage(stage, isolation=Isolation(memory=16 << 20))
    assert faults[0].code in ("usd-memory", "usd-crash", "usd-open")
    assert faults[0].severity == "error"
    assert faults[0].help is not None


@pytest.mark.parametrize("name", ["garbage.usda", "garbage.usdc", "garbage.usdz", "cut.usdc"])
def test_what_is_no_stage_is_an_error(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    if name == "cut.usdc":
        compiled = compile_text("for i in 0..50 { sphere().translate(i, 0, 0) }")
        from compiler.usd_export import export_stage

        export_stage(compiled, path)
        path.write_bytes(path.read_bytes()[:-200])
    else:
        path.write_bytes(bytes(range(256)) * 40)
    with pytest.raises(CompileError) as caught:
        ovolo.compile_file(path)
    assert caught.value.diagnostics[0].code == "usd-open"


@pytest.mark.parametrize("rate", ["0", "-1"])
def test_rates_that_hang_usd_core_are_errors_of_their_layer(tmp_path: Path, rate: str) -> None:
    (tmp_path / "sub.usda").write_text(
        f"#usda 1.0\n(timeCodesPerSecond = {rate})\n"
        'def Sphere "s" {\ndouble radius.timeSamples = { 1: 1, 2: 2 }\n}\n'
    )
    stage = tmp_path / "root.usda"
    stage.write_text("#usda 1.0\n(subLayers = [@sub.usda@])\n")
    with pytest.raises(CompileError) as caught:
        ovolo.compile_file(stage, time=1.5)
    assert caught.value.diagnostics[0].code == "usd-time"
    assert "sub.usda" in caught.value.diagnostics[0].message


def test_cycles_are_told_with_their_prim(load: Load) -> None:
    imported = load('def "a" (references = </a/b>) {\ndef "b" (references = </a>) {\n}\n}\n')
    assert {d.code for d in imported.diagnostics} == {"usd-composition"}
    assert all(d.primary.place.prim.startswith("/a") for d in imported.diagnostics)
