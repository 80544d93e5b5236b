"""The catalogue of diagnostic codes: every fault that a user can cause, one line each.

A code begins with the phase that finds it; `usd-` codes come from the importer of stages, `mesh-`
codes from mesh files, `texture-` codes from pictures of materials, `ir-` codes from compiled
scenes. The language reference shows each code of the language in an example.
"""

from __future__ import annotations

from dsl.diagnostics import Diagnostic, Label, Severity
from dsl.records import value
from dsl.spans import Place


@value
class Code:
    """What a code means, in one line."""

    summary: str
    severity: Severity = "error"


CODES: dict[str, Code] = {
    "syntax-unexpected-character": Code("a character that begins no word of the language"),
    "syntax-unterminated-string": Code("a string without its closing quote on the same line"),
    "syntax-unterminated-comment": Code("a `/*` without its `*/`"),
    "syntax-escape": Code("a backslash in a string that is followed by no known escape"),
    "syntax-number": Code("a number that float64 cannot hold"),
    "syntax-unknown-unit": Code("a number followed by letters that are no unit of angle"),
    "syntax-color": Code("a `#` that is not followed by six hexadecimal digits"),
    "syntax-expected": Code("something else was expected here"),
    "syntax-unclosed": Code("a bracket that is opened and never closed"),
    "syntax-unmatched": Code("a bracket that is closed and was never opened"),
    "syntax-chained-comparison": Code("a comparison of a comparison, such as `a < b < c`"),
    "syntax-reserved-word": Code("a word that the language keeps for itself, used as a name"),
    "syntax-positional-after-named": Code("an argument without a name after one with a name"),
    "syntax-param-place": Code("a `param` in a block, where nobody could set it"),
    "syntax-vector-length": Code("a vector of more than four components"),
    "name-unknown": Code("a name that nothing visible here defines"),
    "name-unknown-setting": Code("a value for a parameter that the scene does not have"),
    "name-duplicate": Code("a name defined twice in one block"),
    "name-before-definition": Code("a function used a name before its `let` was reached"),
    "name-unknown-parameter": Code("an argument's name that the function does not have"),
    "name-unknown-member": Code("a member or suffix call that the value does not have"),
    "type-angle-unit": Code("a number where an angle is due, or an angle where a number is"),
    "type-mismatch": Code("a value of another type than is due here"),
    "type-operator": Code("an operator between values for which it has no meaning"),
    "type-not-callable": Code("a call of something that is no function"),
    "type-not-a-scene-value": Code("a value in a group that a scene cannot contain"),
    "type-missing-argument": Code("a parameter without a default was given no argument"),
    "type-too-many-arguments": Code("more arguments than the function has parameters"),
    "type-argument-twice": Code("a parameter that is given two arguments"),
    "value-division-by-zero": Code("a division by zero"),
    "value-not-finite": Code("a result too large for float64"),
    "value-domain": Code("an argument at which the function has no value"),
    "value-out-of-range": Code("a number outside the interval that is allowed here"),
    "value-not-an-integer": Code("a number with a fraction where a whole number is due"),
    "value-index": Code("an index beyond the ends of a list or vector"),
    "value-order": Code("an interval or a box whose lower end is not below its upper end"),
    "value-bevel": Code("a bevel beyond the exact limit of its shape"),
    "value-degenerate": Code("a direction, frame or triangle that is not determined"),
    "value-choice": Code("a word that is not among those possible here"),
    "file-missing": Code("a file that does not exist"),
    "file-outside": Code("a path that leads out of the folder that scenes may read"),
    "file-unreadable": Code("a file that exists but cannot be read"),
    "file-too-large": Code("a file beyond the size limit"),
    "file-encoding": Code("a scene file that is not UTF-8 text"),
    "file-cycle": Code("a file that uses itself, directly or through others"),
    "limit-source": Code("a source text beyond the size limit"),
    "limit-nesting": Code("brackets nested beyond the limit"),
    "limit-steps": Code("a program that takes more steps than the limit"),
    "limit-call-depth": Code("function calls nested beyond the limit"),
    "limit-iterations": Code("a loop of more iterations than the limit"),
    "limit-nodes": Code("a program that makes more objects than the limit"),
    "limit-list-length": Code("a list longer than the limit"),
    "limit-string-length": Code("a string longer than the limit"),
    "limit-files": Code("a program that uses more files than the limit"),
    "scene-singular-transform": Code("an instance whose transform has no inverse", "warning"),
    "scene-out-of-range": Code("something too far away, too large or too small", "warning"),
    "scene-too-many-instances": Code("a scene of more instances than the limit"),
    "scene-too-many-lights": Code("a scene of more lights and cameras than the limit"),
    "scene-too-deep": Code("instances of groups nested beyond the limit"),
    "advice-unused": Code("a name that nothing uses", "warning"),
    "advice-color": Code("a color far brighter than 1, as of bytes", "warning"),
    "advice-comment": Code("a comment that was probably meant as a division", "warning"),
    "advice-descending": Code("a loop down an interval, which does nothing", "warning"),
    "advice-shadowing": Code("a name that hides another of the program", "warning"),
    "advice-coincident": Code("an object that stands twice at one place", "warning"),
    "advice-condition": Code("a transform that stretches far more in one direction", "warning"),
    "advice-no-area": Code("a mesh whose triangles are all lines or points", "warning"),
    "advice-outside": Code("an object that no camera of the scene sees", "warning"),
    "mesh-format": Code("a file of a format that is not read as a mesh"),
    "mesh-unreadable": Code("a mesh file that is damaged"),
    "mesh-too-large": Code("a mesh of more triangles than the limit"),
    "mesh-bad-faces": Code("faces of a mesh file that cannot be drawn", "warning"),
    "mesh-empty": Code("a mesh file without triangles"),
    "texture-unreadable": Code("a texture in whose place its fallback is drawn", "warning"),
    "ir-syntax": Code("a text that is no scene in its IR form"),
    "ir-damaged": Code("a compiled scene that cannot be read"),
    "ir-invalid": Code("a compiled scene whose tables contradict each other"),
    "usd-open": Code("a stage that cannot be opened"),
    "usd-prim": Code("a prim that the stage does not have"),
    "usd-time": Code("a time code, or a rate of time codes, at which nothing can be read"),
    "usd-variant": Code("a variant that the stage does not have"),
    "usd-outside": Code("a stage that names files outside of the folder that may be read"),
    "usd-deadline": Code("a stage that takes longer to import than is allowed"),
    "usd-memory": Code("a stage that takes more memory to import than is allowed"),
    "usd-crash": Code("a stage at which usd-core itself fails"),
    "usd-composition": Code("a part of a stage that could not be composed", "warning"),
    "usd-unsupported": Code("a prim of a type that is not drawn", "warning"),
    "usd-unused": Code("what a stage says of a prim and the picture does not show", "warning"),
    "usd-attribute": Code("an attribute whose value has no meaning there", "warning"),
    "usd-transform": Code("a transform operation that could not be used whole", "warning"),
    "usd-shape": Code("a primitive without extent", "warning"),
    "usd-mesh": Code("a mesh, or faces of it, that cannot be drawn", "warning"),
    "usd-subdivision": Code("a subdivision surface that is not drawn as it says", "warning"),
    "usd-skinning": Code("a skinned mesh that is not posed as it says", "warning"),
    "usd-curves": Code("curves or points that are not drawn as they say", "warning"),
    "usd-instancer": Code("instances of a point instancer that are left out", "warning"),
    "usd-primvar": Code("a display colour that is not drawn as it says", "warning"),
    "usd-material": Code("a material that is not drawn as it says", "warning"),
    "usd-light": Code("a light that does not shine as it says", "warning"),
    "usd-camera": Code("a camera that does not see as it says", "warning"),
    "usd-program": Code("what of a stage a program has no word for", "warning"),
    "limit-diagnostics": Code("more faults than are shown", "warning"),
}


def is_advice(code: str) -> bool:
    """Whether a code tells of what is no fault and probably not meant."""
    return code.startswith("advice-")


def diagnostic(
    code: str,
    message: str,
    place: Place | None = None,
    text: str = "",
    *,
    help: str | None = None,
    secondary: tuple[Label, ...] = (),
) -> Diagnostic:
    """A diagnostic of the catalogue's severity; KeyError for a code that is not listed."""
    primary = None if place is None else Label(place, text)
    return Diagnostic(code, CODES[code].severity, message, primary, secondary, help)
