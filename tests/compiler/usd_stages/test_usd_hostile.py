"""Damaged and hostile stages: whatever they are, what comes out is a scene or diagnostics."""

from __future__ import annotations

import random
import re
import zipfile
from collections.abc import Callable
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest

import ovolo
from compiler.usd import import_stage
from compiler.usd.tokens import crate_text
from dsl.diagnostics import CompileError
from tests.compiler.usd_stages.crate_files import DICTIONARY, UNREGISTERED, nested_values

ORCHARD = Path(__file__).parents[3] / "examples" / "orchard.usda"
NUMBERS = ("-1", "1e308", "nan", "inf", "0", "99999999999", "2147483647", "-0.0", "7")
TYPES = ("Mesh", "Cube", "PointInstancer", "BasisCurves", "Camera", "OvoloWedge", "SphereLight")
_NUMBER = re.compile(r"(?<![\w.])-?\d+(\.\d+)?(?![\w.])")


def damaged(text: str, chance: random.Random) -> str:
    """A stage with some numbers, types or lines that are not what they should be."""
    for _ in range(chance.randrange(1, 6)):
        match chance.randrange(3):
            case 0:
                found = chance.choice(list(_NUMBER.finditer(text, 12)))
                text = text[: found.start()] + chance.choice(NUMBERS) + text[found.end() :]
            case 1:
                lines = text.split("\n")
                line = chance.randrange(1, len(lines))
                if not set("{}") & set(lines[line]):
                    del lines[line]
                text = "\n".join(lines)
            case _:
                found = chance.choice(list(re.finditer(r"\bdef (\w+) ", text)))
                text = text[: found.start(1)] + chance.choice(TYPES) + text[found.end(1) :]
    return text


@pytest.mark.parametrize("seed", range(30))
def test_damaged_stages_are_scenes_or_diagnostics(seed: int, tmp_path: Path) -> None:
    stage = tmp_path / "stage.usda"
    stage.write_text(damaged(ORCHARD.read_text(), random.Random(seed)))
    with suppress(CompileError):
        ovolo.compile_file(stage, complexity="limit")


@pytest.mark.parametrize("seed", range(10))
def test_broken_bytes_are_scenes_or_diagnostics(seed: int, tmp_path: Path) -> None:
    chance = random.Random(seed)
    data = bytearray(ORCHARD.read_bytes())
    for _ in range(chance.randrange(1, 20)):
        data[chance.randrange(len(data))] = chance.randrange(256)
    stage = tmp_path / "stage.usda"
    stage.write_bytes(data)
    with suppress(CompileError):
        ovolo.compile_file(stage)


def test_packages_that_unpack_to_much_are_not_unpacked(tmp_path: Path) -> None:
    stage = tmp_path / "bomb.usdz"
    with zipfile.ZipFile(stage, "w", zipfile.ZIP_DEFLATED) as package:
        package.writestr("a.usda", "#usda 1.0\n" + " " * 50_000_000)
    with pytest.raises(CompileError) as caught:
        ovolo.compile_file(stage)
    assert caught.value.diagnostics[0].code == "usd-open"


def test_a_mesh_without_a_usable_face_draws_nothing(load: Callable[..., Any]) -> None:
    imported = load(
        'def Mesh "m" {\nint[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 99]\n'
        "point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n}\n"
    )
    assert imported.leaves == []
    assert imported.said("draws nothing").primary.place.prim == "/m"


def test_prims_beyond_a_thousand_levels_are_left_out(tmp_path: Path) -> None:
    depth = 1200
    stage = tmp_path / "deep.usda"
    ball = 'def Sphere "s" {\n}\n'
    stage.write_text("#usda 1.0\n" + f'def "a" {{\n{ball}' * depth + "}\n" * depth)
    graph, faults = import_stage(stage)
    (fault,) = faults
    assert (fault.code, fault.severity) == ("usd-unsupported", "warning")
    assert "1000 levels" in fault.message
    assert graph.root is not None


@pytest.mark.parametrize("kind", [DICTIONARY, UNREGISTERED])
def test_values_of_crates_that_nest_too_deep_are_refused(tmp_path: Path, kind: int) -> None:
    # usd-core crashes at some 20 000 levels.
    path = tmp_path / "deep.usdc"
    path.write_bytes(nested_values(kind, 50_000))
    _, found = import_stage(path)
    assert [(d.code, d.message) for d in found] == [
        ("usd-open", "the stage nests deeper than 5000 levels")
    ]
    package = tmp_path / "deep.usdz"
    with zipfile.ZipFile(package, "w") as archive:
        archive.write(path, "deep.usdc")
    assert [d.message for d in import_stage(package)[1]] == [
        "the stage nests deeper than 5000 levels"
    ]
    layer = tmp_path / "layer.usda"
    layer.write_text("#usda 1.0\n(subLayers = [@deep.usdc@])\n")
    assert [d.message for d in import_stage(layer)[1]] == [
        "layer `deep.usdc` nests deeper than 5000 levels"
    ]


ARCS = {
    "sublayer": "(subLayers = [@deep.usda@])\n",
    "reference": 'def "p" (references = @./deep.usda@) {\n}\n',
    "payload": 'def "p" (payload = @deep.usda@</x>) {\n}\n',
    "variant": """def "p" (variants = { string v = "a" }
    add variantSets = "v") {
    variantSet "v" = {
        "a" {
        }
        "b" (references = @deep.usda@) {
        }
    }
}
""",
    "clip": """def "p" (clips = { dictionary default = { asset[] assetPaths = [@deep.usda@] } }) {
}
""",
    "template": """def "p" (clips = {
    dictionary default = { string templateAssetPath = "de##.usda" }
}) {
}
""",
    "further": "(subLayers = [@between.usdc@])\n",
}


@pytest.mark.parametrize("suffix", ["usda", "usdc", "usdz"])
@pytest.mark.parametrize("arc", ARCS)
def test_layers_that_nest_too_deep_are_found_wherever_they_are_named(
    tmp_path: Path, arc: str, suffix: str
) -> None:
    from pxr import Sdf

    def write(name: str, text: str) -> Path:
        layer = Sdf.Layer.CreateAnonymous(".usda")
        layer.ImportFromString("#usda 1.0\n" + text)
        assert layer.Export(str(tmp_path / name))
        return tmp_path / name

    write("between.usdc", ARCS["reference"])
    named = write(f"stage.{suffix.replace('z', 'c')}", ARCS[arc])
    if suffix == "usdz":
        text = re.sub("(?=deep.usda|between.usdc|de##)", f"{tmp_path}/", ARCS[arc])
        with zipfile.ZipFile(tmp_path / "stage.usdz", "w") as archive:
            archive.write(write("inside.usdc", text.replace("./", "")), "inside.usdc")
        named = tmp_path / "stage.usdz"
    (tmp_path / "deep.usda").write_text("#usda 1.0\n" + 'def "a" {\n' * 50_000 + "}\n" * 50_000)
    assert [(d.code, d.message) for d in import_stage(named)[1]] == [
        ("usd-open", "layer `deep.usda` nests deeper than 5000 levels")
    ]


@pytest.mark.parametrize("suffix", ["usda", "usdc"])
@pytest.mark.parametrize("expression", ["'${V}.usda'", 'if(eq(${V}, "a"), "x.usda", "deep.usda")'])
def test_what_expressions_may_name_is_looked_at(
    tmp_path: Path, expression: str, suffix: str
) -> None:
    from pxr import Sdf

    (tmp_path / "deep.usda").write_text("#usda 1.0\n" + 'def "a" {\n' * 50_000 + "}\n" * 50_000)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.expressionVariables = {"V": "deep"}
    Sdf.CreatePrimInLayer(layer, "/a").referenceList.Prepend(Sdf.Reference(f"`{expression}`"))
    layer.Export(str(tmp_path / f"stage.{suffix}"))
    assert [d.message for d in import_stage(tmp_path / f"stage.{suffix}")[1]] == [
        "layer `deep.usda` nests deeper than 5000 levels"
    ]


def test_more_layers_than_are_looked_at_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from compiler.usd import nesting, opening

    for name in "abcd":
        (tmp_path / f"{name}.usda").write_text("#usda 1.0\n")
    names = ", ".join(f"@{name}.usda@" for name in "abcdefgh")  # of which half are missing
    (tmp_path / "stage.usda").write_text(f"#usda 1.0\n(subLayers = [{names}])\n")
    for limit, refused in ((5, False), (4, True)):
        monkeypatch.setattr(nesting, "LAYERS", limit)
        monkeypatch.setattr(opening, "LAYERS", limit)
        said = [d.message for d in import_stage(tmp_path / "stage.usda")[1]]
        assert (f"the stage names more than {limit} layers" in said) == refused


@pytest.mark.parametrize("seed", range(4))
def test_the_text_of_a_crate_has_all_its_tokens(tmp_path: Path, seed: int) -> None:
    from pxr import Sdf

    chance = random.Random(seed)
    layer = Sdf.Layer.CreateAnonymous(".usda")
    names = {"".join(chance.choices("abcdefg", k=chance.randrange(1, 80))) for _ in range(3000)}
    names |= {"r" * 1000, *(f"very_long_prefix_that_is_the_same_{n}" for n in range(3000))}
    for name in names:
        Sdf.CreatePrimInLayer(layer, f"/{name}").typeName = name[::-1]
    path = tmp_path / "layer.usdc"
    layer.Export(str(path))
    with path.open("rb") as file:
        text = crate_text(file)
    found = set(text.decode().split("\0"))
    assert names | {name[::-1] for name in names} <= found
    data = path.read_bytes()
    for _ in range(300):  # whatever the bytes are, it ends
        broken = bytearray(data)
        for _ in range(3):
            broken[chance.randrange(len(data))] = chance.randrange(256)
        crate_text(BytesIO(broken[: chance.randrange(len(data))]))


def test_values_of_crates_that_hold_themselves_or_less_are_read(tmp_path: Path) -> None:
    path = tmp_path / "deep.usdc"
    path.write_bytes(nested_values(DICTIONARY, 3000))
    assert {d.code for d in import_stage(path)[1]} == {"usd-composition"}  # the old version
    cycle = tmp_path / "cycle.usdc"
    cycle.write_bytes(nested_values(DICTIONARY, 6000, cycle=True))
    assert "usd-open" in {d.code for d in import_stage(cycle)[1]}


def test_many_small_dictionaries_of_a_crate_are_not_deep(tmp_path: Path) -> None:
    from pxr import Usd

    path = tmp_path / "many.usdc"
    stage = Usd.Stage.CreateNew(str(path))
    for number in range(6000):
        prim = stage.DefinePrim(f"/p{number}", "Xform")
        prim.SetCustomData({"a": {"n": number, "b": {"s": str(number)}}})
    stage.Save()
    assert import_stage(path)[1] == []
