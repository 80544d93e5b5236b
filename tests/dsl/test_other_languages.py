"""What people write who know another language: one fault, one message, a mend."""

from __future__ import annotations

from pathlib import Path

import pytest

from dsl.budget import DEFAULT_LIMITS
from dsl.elsewhere import MEANT, SIGNS, WORDS
from dsl.evaluate import evaluate_source
from dsl.files import Files
from dsl.lexer import tokenize
from dsl.parser import parse
from dsl.spans import Source, Span
from dsl.tokens import KEYWORDS

FAULTS = [
    # Python
    ("let n = 5\nif n is 5 { sphere() }", "is", "`==` compares"),
    ("let n = 5\nif n in [1, 5] { sphere() }", "in", "a == b or a == c"),
    ("let l = [1, 2]\nlet m = map(sqrt, l)", "map", "for x in list"),
    ('camera(from: (0, 0, 5), name: f"left")', '"left"', "nothing stands before it"),
    ('let n = "a" + 3', "+", "not joined"),
    ("let r = 1\nr = r + 1\nsphere(radius: r)", "=", "never change"),
    ("let m = [[1, 2], [3]]\nsphere(radius: m[0, 1])", ",", "list[i][j]"),
    ("for i in 0..5..2 { sphere() }", "..", "2 * i"),
    ("if 5 > 3 and < 8 { sphere() }", "<", "a < b and a > c"),
    ('let m = load("bunny.obj")\nm', "load", 'mesh("file.obj")'),
    ("sphere()\nprint(1)", "print", "prints nothing"),
    ("for i in 0..3:\n    sphere()\n    box().translate(i, 0, 0)\ntorus()", ":", "0..n {"),
    ("let a = 1\nif a == 1:\n  sphere()\nelif a == 2:\n  box()\nelse:\n  torus()", ":", "if cond"),
    ("x = 5\nsphere(radius: x)", "=", "let name = value"),
    ("def ball(r):\n    return sphere(radius: r)\nball(2)", "def", "fn name"),
    ("# one\n# two\nsphere() # three", "#", "//"),
    ("import math\nsphere(radius: math.pi)", "import", "`pi`"),
    ("from math import sqrt\nsphere(radius: sqrt(2))", "from", "sqrt(2)"),
    ("import bricks\nsphere()", "import", "use"),
    ('let name = f"ball {1}"\nsphere()', '"ball {1}"', "no value in it"),
    ("sphere().translate(i, 0, 0) for i in 0..3", "for", "for i in 0..n"),
    ("for x, y in [1, 2] { sphere() }", ",", "for x in a, y in b"),
    ("for i in 0:10 { sphere() }", ":", "a..b"),
    ("class Ball:\n    pass\nsphere()", "class", "fn name"),
    ("let l = [1, 2]\nsphere(radius: sum(l))", "sum", "total(list"),
    ("sphere(radius: max([1, 2]))", "[1, 2]", "list[0]"),
    ("sphere(radius: random.uniform(0, 1))", "uniform", "`random(…)`"),
    ("let s = sphere()\ns.x = 3", "=", "never change"),
    ("let r = 2 ** 3\nsphere(radius: r)", "**", "pow(a, b)"),
    ("let f = |x| 2 * x\nsphere(radius: f(1))", "|", "fn name"),
    ("fn () { sphere() }", "(", "fn name"),
    ("fn f(n) {\n  if n == 0 { return box() }\n  f(n - 1)\n}\nf(3)", "return", "`return` out"),
    ("fn area(r) { let a = r * r }\nsphere(radius: area(2))", "area(2)", "without an expression"),
    ("let big = True\nif big { sphere() }", "True", "true"),
    ("let a = 1\nif a == 1 { sphere() } elif a == 2 { box() } else { torus() }", "elif", "else if"),
    ("camera(from: (0, 0, 5), name: 'left')", "'left'", '"'),
    ("[sphere().translate(i, 0, 0) for i in 0..3]", "for", "for i in 0..n"),
    ("sphere(radius=2)", "=", "radius: value"),
    ("let l = [1, 2]\nfor i in 0..len(l) { sphere() }", "len", "count(list)"),
    ("let f = lambda x: x + 1\nsphere(radius: f(1))", "lambda", "fn name"),
    ("let x = 1\nx += 1\nsphere(radius: x)", "+=", "never change"),
    ("let l = [1, 2]\nsphere(radius: l[-1])", "-1", "count(list) - 1"),
    ("let a = 3 if true else 4\nsphere(radius: a)", "if", "if condition"),
    # JavaScript
    ("let r = 2;\nsphere(radius: r);", ";", "every `;`"),
    ("var r = 2\nsphere(radius: r)", "var", "let name"),
    ("const r = 2;\nsphere(radius: r)", "const", "let name"),
    ("function ball(r) { return sphere(radius: r) }\nball(2)", "function", "fn name"),
    ("for (let i = 0; i < 10; i++) {\n  sphere().translate(i, 0, 0);\n}", "(", "0..n"),
    ("for (const x of [1, 2]) { sphere(radius: x) }", "(", "0..n"),
    ("let ball = (r) => sphere(radius: r)\nball(2)", "=>", "fn name"),
    ("let a = 1\nif (a === 1) { sphere() }", "===", "`==`"),
    ("let a = true ? 1 : 2\nsphere(radius: a)", "?", "if condition"),
    ("sphere({radius: 2})", ":", "round brackets"),
    ("sphere().rotate_y(Math.PI / 2)", "Math", "pi"),
    ("let s = new sphere(2)\ns", "new", "sphere(radius: 2)"),
    ("let b = [...[1], 3]\nfor i in b { sphere() }", "...", "a + b"),
    ("if true && 1 == 1 { box() }", "&&", "and"),
    # C and GLSL
    ("float r = 2.0;\nsphere(radius: r)", "float", "let name"),
    ("float f(float x) { return x * 2.0; }\nsphere(radius: f(1))", "float", "let name"),
    ("#define R 2\nsphere(radius: R)", "#define", "let name"),
    ("let v = (1, 2, 3)\nsphere(radius: length(v.xy))", "xy", "(v.x, v.y)"),
    ("sphere(radius: fract(1.5))", "fract", "x % 1"),
    ("sphere(radius: smoothstep(0, 1, 0.5))", "smoothstep", "t * t"),
    ("sphere().translate(vec3(1, 0, 0))", "vec3", "(x, y, z)"),
    ("sphere(radius: 2.)", ")", "2.0"),
    ("sphere(radius: .5)", ".", "0.5"),
    ("sphere(radius: 2.0f)", "f", "2.0"),
    ("for (int i = 0; i < 3; ++i) { sphere(); }", "(", "0..n"),
    # OpenSCAD
    ("module ball(r) { sphere(r); }\nball(2)", "module", "fn name"),
    ("translate([1, 0, 0]) sphere(1);", "sphere", "follows its object"),
    ("difference() { box(); sphere(); }", "difference", "not cut"),
    ("for (i = [0:10]) { sphere() }", "(", "0..n"),
    ("for i in [0:10] { sphere() }", ":", "a..b"),
    ('color("red") sphere(1);', "color", "rgb(1, 0, 0)"),
    ("sphere().rotate([0, 90, 0])", "[0, 90, 0]", "(0, 90, 0)"),
    ("cube((1, 2, 3))", "cube", "box"),
    ("rotate([0, 90, 0]) sphere(1);", "sphere", "follows its object"),
    ("include <bricks.scad>\nsphere()", "include", "use"),
    ("box(1, 2, 3)", "1", "(1, 2, 3)"),
    ("box(2)", "2", "(2, 2, 2)"),
    ("box(width: 1, height: 2, depth: 3)", "width", "size: (x, y, z)"),
    ("cylinder(height: 2)", "height", "y: 0..2"),
    ("cylinder(1, 2)", "2", "0..2"),
    ("sphere(d: 2)", "d", "half"),
    ("sphere(center: (1, 2, 3))", "center", ".translate(x, y, z)"),
    ("sphere().subtract(box())", "subtract", "not cut"),
    ("box(size: 1, 2, 3)", "2", "size: (…)"),
    ("sphere(material: matte(#ff0000))", "material", ".material(matte(color))"),
    ("sphere(color: #ff0000)", "color", ".material(matte(color))"),
    ("let a = sphere() - box()\na", "-", "not cut"),
    # POV-Ray
    ("sphere((0, 1, 0), 1)", "1", ".translate(x, y, z)"),
    ("sphere { <0, 0, 0>, 1 }", "{", "name(…)"),
    ("#declare R = 2;\nsphere(radius: R)", "#declare", "let name"),
    ("sphere().translate(<1, 2, 3>)", "<", "(x, y, z)"),
    ('#include "colors.inc"\nsphere()', "#include", "use"),
    # anybody
    ('def Xform "World" { }', "def", 'usd("file.usda")'),
    ("#usda 1.0", "#usda", 'usd("file.usda")'),
    ("sphere().matrix((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0))", "(1, 0, 0, 0)", "inner brackets"),
    ("sphere().transform([1, 0, 0, 0])", "[1, 0, 0, 0]", "`matrix(…)`"),
    ("sphere().transform(translate(1, 2, 3) + scale(2))", "+", "a * b"),
    ("let step = 1\nlet r = step 2\nsphere(radius: r)", "2", "a line of its own"),
    ("sphere().material(matte(#ff000080))", "#ff000080", "`#ff0000`"),
    ("sphere().material(matte(rgb(1, 0, 0, 0.5)))", "0.5", "opacity: 0.5"),
    ("sphere().material(matte(hsl(0.5, 1, 1)))", "hsl", "rgb(1, 0, 0)"),
    ("let x = 1\nmatch x { }", "match", "else if"),
    ("for i in 0..3 {\n  box().scale(2 * i + 1)\nend\n}", "end", "{ … }"),
    ("ring(inner: 1, outer: 2)", "inner", "r: 1..2"),
    ("settings(spp: 64)", "spp", "samples"),
    ("sphere(radius: 1 + frame)", "frame", "`time`"),
    ("capsule()", "capsule", "bevel: 1"),
    ('text("hi")', "text", "mesh("),
    ("sphere().material(emissive(#ff0000))", "emissive", "glow"),
    ("Let a = 1\nsphere(radius: a)", "a", "let"),
    ("let in = 3\nsphere(radius: in)", "in", "another name"),
    ("let first ball = sphere()", "ball", "first_ball"),
    ("let 2ball = sphere()", "ball", "begins with a letter"),
    ("let my-ball = sphere()", "-", "`_`"),
    ("sphere().rotate_y(1.57)", "1.57", "1.57rad"),
    ("sphere().rotate_y(radians(90))", "radians", "90deg"),
    ("sphere().material(color: #ff0000)", "color", "matte(rgb(1, 0, 0))"),
    ('sky("sunset.hdr")', '"sunset.hdr"', 'texture: "sunset.hdr"'),
    ("sun(direction: down)", "down", "(0, -1, 0)"),
    ("point_light(0, 5, 0, intensity: 9)", "intensity", "`position`, `intensity`"),
    ("let r = random()\nsphere(radius: r)", "random()", "random(i)"),
    ('mesh "bunny.obj"', '"bunny.obj"', "mesh(…)"),
    ("sphere(radius: 3in)", "in", "write `3`"),
    ("sphere().material(red)", "red", "#ff0000"),
    ('sphere().material(matte("red"))', '"red"', "#ff0000"),
    ("sphere().material(matte(0xff0000))", "xff0000", "#ff0000"),
    ("sphere(radius 2)", "2", "radius: …"),
    ("sphere().translate(1 2 3)", "2", "`,`"),
    ("sphere(radius: 1_000)", "_000", "1000"),
    ("sphere(radius: 2px)", "px", "2"),
    ("if 1 { sphere() }", "1", "x > 0"),
    ("camera(position: (0, 0, 5))", "position", "from"),
    ("sphere())", ")", "open the bracket"),
    ("let r =\nsphere(radius: r)", "", "behind the `=`"),
    ("fn f() -> number { sphere() }\nf()", "->", "no type"),
    ("for i in 0..7 // 2 { sphere() }", "", "floor(a / b)"),
    ("let a = [\n  (1, 2)\n  (3, 4),\n]\nsphere(radius: a[0].x)", "(1, 2)\n  ", "`,`"),
    ("let r = ２\nsphere(radius: r)", "２", "write `2`"),
    ("sphere（radius: 2）", "（", "write `(`"),
    ("cylinder(y: 0 to 3)", "to", "a..b"),
    ("cylinder(y: [0, 3])", "[0, 3]", "a..b"),
    ("cylinder(y: (0, 3))", "(0, 3)", "a..b"),
    ("let a = {1, 2, 3}\nfor i in a { sphere() }", ",", "[a, b]"),
    ("param n = 3 in 1, 2, 3\nsphere(radius: n)", ",", "[a, b]"),
    ("let a = [1, 2]\nsphere(radius: a.length)", "length", "count(list)"),
    ("settings(integrator: direct)", "direct", '`"direct"`'),
    ("sphere(radius: sqrt 4)", "4", "sqrt(…)"),
    ("-- a ball\nsphere()", "ball", "//"),
    ("let wall = {\n  box()\n\nwall.scale(2)", "{", "add a `}`"),
    ("let a = 5 mod 2\nsphere(radius: a)", "mod", "a % b"),
    ("let f(x) = x * 2\nsphere(radius: f(2))", "(", "fn name"),
    ("let a = 1\nif (a = 1) { sphere() }", "=", "`==` compares"),
    ("sphere(radius:)", ")", "behind the `:`"),
    ('sphere(radius: "2")', '"2"', "without quotes: `2`"),
    ('sphere().rotate_y("90deg")', '"90deg"', "without quotes: `90deg`"),
    ("sphere().rotate_y(pi / 4)", "pi / 4", "1rad"),
    ('sphere().material("red")', '"red"', "matte(rgb(1, 0, 0))"),
    ("sphere().translate(1, 0, 0),", ",", "leave the `,` out"),
    ("let a = 2 * sphere()\na", "*", ".scale(2)"),
    ("let a = sphere() + (1, 2, 3)\na", "+", ".translate(v)"),
    ("sphere().rotate(0, 45, 0)", "0", ".rotate_y(b)"),
    ("sphere().rotate((0, 45, 0))", "sphere().rotate((0, 45, 0))", ".rotate_y(b)"),
    ("sphere().rotate(90deg, (0, 1, 0))", "90deg", "rotate(axis, angle)"),
    ('sphere().rotate("y", 90deg)', '"y"', "(0, 1, 0)"),
    ('sphere().reflect("x")', '"x"', "(0, 1, 0)"),
    ("sphere(radius: '2')", "'2'", "without quotes: `2`"),
    ("sphere().scale((1, 2, 3))", "(1, 2, 3)", "scale(v.x, v.y, v.z)"),
    ("sphere().material(matte(1, 0, 0))", "0", "rgb(1, 0, 0)"),
    ("plane(size: 10)", "size", "no ends"),
    ("sphere((1, 2, 3))", "(1, 2, 3)", ".translate(x, y, z)"),
    ("let v = (1, 2, 3)\nsphere().scale(v + 1)", "+", "(1, 1, 1)"),
    ("let v = (1, 2, 3)\ntorus(major: v)", "v", "v.x"),
    ("sphere().translate(1, 0, 0).", "", "leave the `.` out"),
    ("sphere()\n  translate(1, 0, 0)", "translate(1, 0, 0)", "`object.translate(1, 0, 0)`"),
    ("group(sphere(), box())", "group", "{ … }"),
    ("group { sphere() }", "group", "{ … }"),
    ("mesh(bunny.obj)", "bunny", '`"bunny.obj"`'),
    ("sphere(radius: 1,5)", "5", "1.5"),
    ("let r = 1,5\nsphere(radius: r)", ",", "1.5"),
    ("sphere(radius: 1 000)", "000", "stand together"),
    ("let l = []\nlet m = l.append(3)", "append", "list + [item]"),
    ("let l = [1, 2]\nsphere(radius: l.0)", "0", "list[0]"),
    ("sphere().transform((1, 0, 0))", "(1, 0, 0)", "translate((1, 0, 0))"),
    ("sphere().copy(3)", "copy", "for i in 0..n"),
    ("let n = param(5)\nsphere(radius: n)", "param", "param name = default"),
    ("sun(direction: (0, -1, 0), intensity: 3)", "intensity", "irradiance"),
    ("point_light(position: (0, 1, 0), power: 3)", "power", "intensity"),
    ("ambient(0.5)", "ambient", "`sky`"),
    ("sphere().material(material(albedo: #ff0000))", "albedo", "diffuse"),
]


@pytest.mark.parametrize(("text", "place", "mend"), FAULTS, ids=lambda words: words[:30])
def test_one_message_at_the_place_with_a_mend(
    text: str, place: str, mend: str, tmp_path: Path
) -> None:
    _, found = evaluate_source(Source("scene.ovo", text), Files(tmp_path))
    assert [each.message for each in found if each.severity == "error"] == [found[0].message]
    label = found[0].primary
    assert label is not None
    assert isinstance(label.place, Span)
    assert text.encode()[label.place.start : label.place.end].decode() == place
    assert mend in (found[0].help or "")


@pytest.mark.parametrize(
    ("text", "codes"),
    [
        ("let n = 7 // 2\nsphere(radius: n)", ["advice-comment"]),
        ("let n = 10 // 3 + k\nsphere(radius: n)", ["advice-comment"]),
        ("let n = 7 // 2 balls\nsphere(radius: n)", []),
        ("let n = 7 // seven\nsphere(radius: n)", []),
        ("sphere() // 1\nbox().translate(9, 0, 0) // 2", []),
        ("sphere().material(matte(rgb(255, 0, 0)))", ["advice-color"]),
        ("sphere().material(matte(rgb(r: 90, g: 60, b: 30)))", ["advice-color"]),
        ("for i in 5..0 { sphere(radius: i) }\nbox()", ["advice-descending"]),
        ("for i in 0..5, j in 1..-1 { sphere(radius: i + j) }\nbox()", ["advice-descending"]),
        ("for i in 2..2 { sphere(radius: i) }\nfor i in -1..0 { box().scale(i) }", []),
        ("sphere().material(glow(rgb(2, 1, 0)))", []),
        ("sphere().material(glow(rgb(99.5, 50, 0)))", []),
        ("fn rgb(r, g, b) { sphere(radius: r + g + b) }\nrgb(255, 0, 0)", []),
    ],
)
def test_advice_on_slips(text: str, codes: list[str]) -> None:
    graph, found = evaluate_source(Source("scene.ovo", text), Files())
    assert graph is not None
    assert not found
    assert [each.code for each in graph.advice] == codes


def test_faults_that_do_not_touch_are_all_told() -> None:
    text = "x = 1\nlet y = 2 ** 3\nif x ! y { sphere() }\nfor (;;) { }\nsphere(z: 1)\nbox() box()"
    _, found = parse(Source("scene.ovo", text))
    assert len(found) == 5
    text = "if !(true && false) || x ≤ 1 { }"
    _, found = parse(Source("scene.ovo", text))
    assert [each.help for each in sorted(found, key=lambda each: each.message)] == [
        *("write `not`", "write `and`", "write `or`", "write `<=`"),
    ]


def test_a_name_of_a_faulty_statement_hides_nothing_that_is_known() -> None:
    text = "let r = 2\nr = 3\nsphere(radius: r, size: 1)"
    _, found = evaluate_source(Source("scene.ovo", text), Files())
    assert [each.code for each in found] == ["syntax-expected", "name-unknown-parameter"]


def test_strings_that_hold_signs_are_strings() -> None:
    _, found = parse(Source("scene.ovo", 'let a = ";"\n";"\nif true { sphere() } "elif"'))
    assert [each.message for each in found] == ["expected the end of the statement, found a string"]


def test_the_tables_do_not_speak_of_what_the_language_has() -> None:
    assert not KEYWORDS.intersection(WORDS)
    for sign in SIGNS:
        tokens, _ = tokenize(Source("", sign), DEFAULT_LIMITS)
        assert len(tokens) > 2 or tokens[0].kind in ("foreign", "fault"), sign
    for sign, meant in MEANT.items():
        tokens, found = tokenize(Source("", sign), DEFAULT_LIMITS)
        assert (tokens[0].kind, len(found)) == (meant, 1)
