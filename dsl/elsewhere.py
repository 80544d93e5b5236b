"""What people write who know another language, and what is written here instead.

From Python, JavaScript, C and GLSL, OpenSCAD and POV-Ray. None of it has a meaning here, so all of
it is free to be a name; only where a program is faulty anyway do these tables help to say why.
"""

from __future__ import annotations

from unicodedata import normalize

LOOP = "a loop emits objects, from a line of its own: `for i in 0..n { … }`"
_FUNCTION = "a function is defined with `fn name(…) { … }`"
_LET = "write `let name = value`"
_USE = 'write `use "file.ovo" as name`'
_TYPE = "nothing has a type to be written: `let name = value`"
_PRINT = "a program prints nothing: its value is the scene"
_SOLIDS = "shapes are not cut or joined: those in one block stand together"
_VECTOR = "a vector is written `(x, y, z)`"
_ANGLE = "an angle has its unit: `90deg`, `1.57rad`, `0.25turn`"
_COLOR = "a color is written `rgb(1, 0, 0)` or `#ff0000`"
_NOTHING = "every name has a value; the empty group is `{}`"
_LAST = "a loop takes its whole range: put what is not always wanted into an `if`"
_QUOTES = 'strings are written in double quotes: `"…"`'
_MATHS = "what is of mathematics is there: `sqrt(2)`, `sin(30deg)`, `pi`"
_AXES = "a direction is a vector: `(0, -1, 0)` is down"
_LISTS = "a loop over a list makes objects: `for x in list { … }`; no function makes lists"
_READ = 'a mesh is placed by `mesh("file.obj")`, a stage by `usd("file.usd")`'
_BRACES = "a block stands in braces: `{ … }`"
_MESH = 'other solids are read from a file: `mesh("file.obj")`'
_STAGE = 'a stage has its own file, ending in `.usda`: `usd("file.usda")` places it'
_MATERIAL = "a material is made by a call: `matte(rgb(1, 0, 0))`"
NEVER = "values never change: `let name = value` names another, computed as `30deg * i` in a loop"
STRING = 'a string is `"…"`: nothing stands before it, and no value in it'

_CHOICES = ("direct", "ambient_occlusion", "normals", "ids", "float32", "float64")

WORDS: dict[str, str] = {
    **dict.fromkeys(("def", "func", "function", "fun", "lambda", "module", "macro"), _FUNCTION),
    **dict.fromkeys(("const", "var", "val", "set", "define", "declare", "local", "mut"), _LET),
    **dict.fromkeys(("float", "int", "double", "number", "string", "bool", "auto"), _TYPE),
    **dict.fromkeys(("import", "include", "from", "require"), _USE),
    **dict.fromkeys(("print", "console", "echo", "printf"), _PRINT),
    **dict.fromkeys(("union", "difference", "intersection", "hull", "minkowski", "merge"), _SOLIDS),
    **dict.fromkeys(("vec2", "vec3", "vec4", "Vector", "vector"), _VECTOR),
    **dict.fromkeys(("radians", "degrees", "deg", "rad"), _ANGLE),
    **dict.fromkeys(
        ("red", "green", "blue", "white", "black", "yellow", "orange", "gray", "grey", "color"),
        _COLOR,
    ),
    **dict.fromkeys(("None", "null", "nil", "undef", "undefined", "pass"), _NOTHING),
    **dict.fromkeys(("break", "continue"), _LAST),
    **dict.fromkeys(("math", "Math", "np", "numpy"), _MATHS),
    **dict.fromkeys(("len", "size"), "write `count(list)`"),
    **dict.fromkeys(("new", "object"), "a shape is made by its call: `sphere(radius: 2)`"),
    "True": "write `true`",
    "False": "write `false`",
    "PI": "write `pi`",
    "TAU": "write `2 * pi`, or an angle as `1turn`",
    "range": "an interval is written `0..n`",
    "return": "the value of a function is that of its block: leave `return` out",
    "while": "loops run over intervals and lists: `for i in 0..n { … }`",
    "uniform": "what may be set from outside is a `param name = default`",
    **dict.fromkeys(("class", "struct"), f"what has parts is a group, or {_FUNCTION}"),
    **dict.fromkeys(("up", "down", "left", "right", "forward", "backward"), _AXES),
    **dict.fromkeys(("hsl", "hsv", "rgba"), _COLOR),
    **dict.fromkeys(("begin", "end", "do", "done", "then", "endif"), _BRACES),
    **dict.fromkeys(("match", "switch", "case"), "write `if a { … } else if b { … } else { … }`"),
    **dict.fromkeys(("frame", "now", "clock"), "write `time`: what `--time` and `--frames` set"),
    **dict.fromkeys(("prism", "pyramid", "polygon", "polyhedron", "text", "extrude"), _MESH),
    "capsule": "it is `cylinder(radius: 1, y: -2..2, bevel: 1)`",
    "image": 'a picture is named where it is used: `sky(texture: "file.exr")`',
    **dict.fromkeys(("map", "filter", "reduce", "zip", "enumerate"), _LISTS),
    **dict.fromkeys(("load", "open", "read"), _READ),
    **dict.fromkeys(("usda", "over"), _STAGE),
    "fract": "write `x % 1`",
    "step": "write `if x < edge { 0 } else { 1 }`",
    "smoothstep": "with `let t = clamp((x - a) / (b - a), 0, 1)` it is `t * t * (3 - 2 * t)`",
    "saturate": "write `clamp(x, 0, 1)`",
    "sign": "write `if x < 0 { -1 } else { 1 }`",
    "trunc": "write `floor(x)`, or `ceil(x)` below 0",
    "distance": "write `length(b - a)`",
    "hypot": "write `length((x, y))`",
    **dict.fromkeys(("log2", "log10", "ln"), "`log(x)` is natural: `log(x) / log(10)`"),
    "noise": "`random(x, y)` is a number for each x and y, unlike that of their neighbours",
    "mod": "write `a % b`",
    "div": "write `floor(a / b)`",
    "str": "numbers are not made strings",
    "sum": "a function that calls itself adds up a list: `list[n] + total(list, n - 1)`",
    "pigment": "a material is bound by `object.material(matte(rgb(1, 0, 0)))`",
    "texture": "a material is bound by `object.material(matte(rgb(1, 0, 0)))`",
    "xor": "write `a != b`",
    "group": "a group is a block: `{ … }`, each object on a line of its own",
    **{word: f'it is a string: write `"{word}"`' for word in _CHOICES},
}
"""What to write in the place of a word."""

DEFINING = frozenset(
    (
        *("def", "func", "function", "fun", "module", "macro", "const", "var", "val", "set"),
        *("define", "declare", "local", "mut", "uniform", "float", "int", "double", "number"),
        *("string", "bool", "auto", "vec2", "vec3", "vec4", "import", "from"),
    )
)
"""Words after which the name that they define follows, perhaps with another of them between."""

ELSE_IF = frozenset(("elif", "elsif", "elseif"))
ELSE_BEGINNINGS = ELSE_IF | {"else"}
"""Words with which the rest of a conditional begins."""

SIGNS: dict[str, str] = {
    "...": "an interval is `a..b`, a loop over it ends before `b`; lists are joined by `a + b`",
    "..=": "an interval is `a..b`; a loop over it ends before `b`",
    "**": "write `pow(a, b)`",
    "^": "write `pow(a, b)`",
    "²": "write `pow(a, 2)`",
    "³": "write `pow(a, 3)`",
    "++": NEVER,
    "--": NEVER,
    "+=": NEVER,
    "-=": NEVER,
    "*=": NEVER,
    "/=": NEVER,
    ":=": _LET,
    "===": "write `==`",
    "!==": "write `!=`",
    "<>": "write `!=`",
    "=>": _FUNCTION,
    "->": "what a function gives has no type to be written: leave it out",
    "?": "write `if condition { a } else { b }`",
    "??": _NOTHING,
    ";": "a statement ends with its line: leave every `;` out",
    "&": "write `and`",
    "|": f"write `or`; {_FUNCTION}",
    "'": _QUOTES,
    "`": _QUOTES,
    "“": _QUOTES,
    "”": _QUOTES,
    "‘": _QUOTES,
    "’": _QUOTES,
    "…": "write `a..b`",
    "°": "write `deg`, as in `40deg`",
    "$": "a name begins with a letter",
    "@": "a name begins with a letter",
    "\\": "a line goes on where a bracket is open, or with a `.` on the next",
}
"""What to write in the place of a sign."""

MEANT: dict[str, str] = {
    "&&": "and",
    "||": "or",
    "!": "not",
    "×": "*",
    "·": "*",
    "÷": "/",
    "−": "-",
    "–": "-",
    "≤": "<=",
    "≥": ">=",
    "≠": "!=",
}
"""Signs that can mean one thing only: reading goes on with it."""

COPIES = "a loop makes copies: `for i in 0..n { … }`"
AXIS = "an axis is a vector: `(0, 1, 0)`"
POINT = "a decimal number has a point: `1.5`"
LENGTHEN = "values never change: `list + [item]` is a longer list"
MIDDLE = "shapes stand at the origin: `.translate(x, y, z)` moves them"
_EXTENT = "the lengths are one vector: `size: (x, y, z)`"
_HALF = "the `radius` is half of the diameter"
_TOP = "bottom and top are an interval: `y: 0..2`"
PARAMETERS: dict[str, tuple[str, str]] = {
    **dict.fromkeys(("width", "depth", "length", "x"), ("size", _EXTENT)),
    **dict.fromkeys(("height", "h"), ("y", _TOP)),
    **dict.fromkeys(("diameter", "d"), ("radius", _HALF)),
    **dict.fromkeys(
        ("center", "centre", "position", "pos", "location", "origin"), ("radius", MIDDLE)
    ),
    "color": ("m", _MATERIAL),
    **dict.fromkeys(("inner", "outer", "r1", "r2", "radius"), ("r", "both radii: `r: 1..2`")),
}
"""What to write in the place of a parameter, for functions that have another."""

FOLLOWING: dict[str, str] = {
    **dict.fromkeys(
        ("material", "color", "colour"), "a material follows: `.material(matte(color))`"
    ),
    **dict.fromkeys(("rotate", "rotation"), "a turn follows: `.rotate_y(90deg)`"),
    **dict.fromkeys(
        ("translate", "translation", "offset"), "a move follows: `.translate(x, y, z)`"
    ),
    **dict.fromkeys(("scale", "scaling"), "a scale follows: `.scale(2)`"),
    "name": "a name is given by `let name = …`",
}
"""What is no parameter, and comes after an object's call."""

MEMBERS: dict[str, dict[str, str]] = {
    "an object": {
        **dict.fromkeys(
            ("color", "colour"), "a color belongs to a material: `.material(matte(color))`"
        ),
        **dict.fromkeys(("copy", "copies", "clone", "repeat", "array"), COPIES),
        **dict.fromkeys(("union", "difference", "intersection", "intersect"), _SOLIDS),
        **dict.fromkeys(("add", "subtract", "cut", "join", "merge"), _SOLIDS),
    },
    "a list": {
        **dict.fromkeys(("append", "push", "add", "insert"), LENGTHEN),
        **dict.fromkeys(("length", "len", "size", "count"), "write `count(list)`"),
    },
}
"""What to write in the place of a member, by the type of the value."""

BESIDE: dict[str, str] = {
    "rotate": "turns about the axes are `.rotate_x(a).rotate_y(b).rotate_z(c)`",
    "scale": "a vector is taken apart: `scale(v.x, v.y, v.z)`",
    "random": "equal seeds give equal numbers: in a loop `random(i)`, and another `random(i, 1)`",
    "rgb": "to see through is a matter of materials: `material(opacity: 0.5)`",
    "matte": "a color is written `rgb(1, 0, 0)` or `#ff0000`",
    "plane": "it has no ends, and is moved by `.translate(0, y, 0)`",
}
"""What to say beside the ways to call a function."""

FILES = frozenset(("obj", "off", "ply", "stl", "glb", "gltf", "ovo", "usd", "usda", "usdc", "usdz"))
"""How the names of files end."""

SYNONYMS: dict[str, tuple[str, ...]] = {
    "albedo": ("diffuse",),
    "ambient": ("sky",),
    "ambientlight": ("sky",),
    "area_light": ("rectangle_light", "disc_light", "cylinder_light"),
    "background": ("sky",),
    "ball": ("sphere",),
    "circle": ("disc",),
    "color": ("diffuse",),
    "cube": ("box",),
    "cuboid": ("box",),
    "donut": ("torus",),
    "environment": ("sky",),
    "eye": ("from",),
    "ground": ("plane",),
    "brightness": ("irradiance", "intensity", "radiance"),
    "chrome": ("metal",),
    "dielectric": ("glass",),
    "emissive": ("glow",),
    "energy": ("irradiance", "intensity", "radiance"),
    "intensity": ("irradiance", "radiance"),
    "lambert": ("matte",),
    "len": ("count",),
    "lerp": ("mix",),
    "light": ("point_light",),
    "location": ("from", "position"),
    "lookat": ("at",),
    "mirror": ("reflect",),
    "move": ("translate",),
    "origin": ("from", "position"),
    "position": ("from",),
    "power": ("irradiance", "intensity", "radiance"),
    "quad": ("rectangle",),
    "size": ("count",),
    "resolution": ("width",),
    "spp": ("samples",),
    "spot_light": ("point_light",),
    "spotlight": ("point_light",),
    "square": ("rectangle",),
    "strength": ("irradiance", "intensity", "radiance"),
    "target": ("at",),
    "tube": ("ring",),
    "tube_light": ("cylinder_light",),
}
"""What other languages call it, without case and underscores: names and parameters."""


def instead_of(words: str) -> str | None:
    """What to write in the place of a sign: also of one that only looks like ours, such as `２`."""
    plain = normalize("NFKC", words)
    if words in SIGNS or plain == words or not plain.isascii() or not plain.isprintable():
        return SIGNS.get(words)
    return f"write `{plain}`"
