"""Opening a stage as the options say, unless reading it could go wrong for good."""

from __future__ import annotations

import math
import re
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from pxr import Sdf, Tf, Usd

from compiler.usd.confinement import outside
from compiler.usd.nesting import DEEPEST, LAYERS, TooManyLayersError, too_deep
from compiler.usd.options import StageOptions
from compiler.usd.report import Report
from compiler.usd.schema import register
from dsl.observation import asked_for

_MESSAGE = re.compile(r" in file \S+ : '(.*?)'\s*(?:\n\tError in|$)", re.DOTALL)
_ADDRESS = re.compile(
    r"\s*\((?:instantiating|getting|computing)[^)]*\)|\s*<0x[0-9a-f]+>|,@anon:[^@]*@"
)


def open_stage(path: str, options: StageOptions, report: Report) -> Any | None:
    """The stage with its mask and variants, or None (reported)."""
    register()
    if options.root is not None:
        for layer, asset, why in outside(path, options.root):
            message = f"layer `{layer}` refers to `{asset}`, {why}"
            report.add("usd-outside", message, help="put the file into the folder")
    try:
        deep = None if report.failed else too_deep(path)
    except TooManyLayersError:
        deep = None
        message = f"the stage names more than {LAYERS:,} layers"
        report.add("usd-open", message, help="flatten some of them into one")
    if deep is not None:
        whose = "the stage" if deep == path else f"layer `{Path(deep).name}`"
        message = f"{whose} nests deeper than {DEEPEST} levels"
        report.add("usd-open", message, help="nest fewer prims or dictionaries in each other")
    mask = _mask(options, report)
    stage = None if report.failed else _composed(path, mask, options, report)
    if stage is None:
        return None
    for variant in options.variants:
        _select(stage, variant, report)
    for layer in stage.GetUsedLayers():
        if layer.realPath:
            asked_for(Path(layer.realPath))
        rate = layer.timeCodesPerSecond
        if not math.isfinite(rate) or rate <= 0.0:
            # usd-core never returns from listing the samples of such a layer.
            report.add(
                "usd-time",
                f"`timeCodesPerSecond = {rate:g}` of layer `{layer.GetDisplayName()}` "
                "is not positive",
                help="remove it, or set it to the number of time codes in a second, such as 24",
            )
    return None if report.failed else stage


def _composed(path: str, mask: Any | None, options: StageOptions, report: Report) -> Any | None:
    load = Usd.Stage.LoadAll if options.payloads else Usd.Stage.LoadNone
    try:
        if mask is None:
            return Usd.Stage.Open(path, load)
        stage = Usd.Stage.OpenMasked(path, mask, load)
        stage.ExpandPopulationMask()  # by what is bound and instanced
        return stage
    except Tf.ErrorException as error:
        report.add("usd-open", f"the stage cannot be opened: {_reason(error, path)}")
        return None


def _reason(error: Exception, path: str) -> str:
    try:
        words = str(error)
    except UnicodeDecodeError:  # usd-core quotes what it could not read
        return "its text is not UTF-8"
    # The first of usd-core's messages is the cause; it names the file by its whole path.
    cause = _MESSAGE.search(words)
    return sentence(cause[1] if cause else words).replace(f"{Path(path).resolve()}:", "")


def sentence(text: str) -> str:
    """One line of usd-core's message, without addresses in memory."""
    quoted = re.search(r": '(.*)'\s*$", text, re.DOTALL)
    line = " ".join(_ADDRESS.sub("", quoted.group(1) if quoted else text).split())
    return line[:400].rstrip(".")


def _mask(options: StageOptions, report: Report) -> Any | None:
    if not options.mask:
        return None
    mask = Usd.StagePopulationMask()
    for words in options.mask:
        path = Sdf.Path(words) if Sdf.Path.IsValidPathString(words) else Sdf.Path()
        if path.IsAbsoluteRootOrPrimPath() and path.IsAbsolutePath():
            mask.Add(path)
        else:
            report.add("usd-prim", f"`{words}` of the mask is no path of a prim")
    return mask


def _select(stage: Any, words: str, report: Report) -> None:
    """Select a variant in the session layer, which is stronger than all others."""
    path = Sdf.Path(words) if Sdf.Path.IsValidPathString(words) else Sdf.Path()
    if not path.IsPrimVariantSelectionPath() or not path.IsAbsolutePath():
        message = f"`{words}` selects no variant"
        report.add("usd-variant", message, help="write it as `/World/Car{color=red}`")
        return
    where = path.GetPrimPath().StripAllVariantSelections()
    name, variant = path.GetVariantSelection()
    prim = stage.GetPrimAtPath(where)
    if not prim:
        report.add("usd-prim", f"the stage has no prim `{where}`")
        return
    sets = prim.GetVariantSets()
    if name not in sets.GetNames():
        _unknown(f"the prim has no variant set `{name}`", name, sets.GetNames(), where, report)
        return
    known = sets.GetVariantSet(name).GetVariantNames()
    if variant not in known:
        _unknown(f"`{name}` has no variant `{variant}`", variant, known, where, report)
        return
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        sets.SetSelection(name, variant)


def _unknown(message: str, word: str, known: list[str], where: Any, report: Report) -> None:
    close = get_close_matches(word, known, 1)
    listed = ", ".join(f"`{name}`" for name in known[:20]) or "none"
    help = f"did you mean `{close[0]}`?" if close else f"there are {listed}"
    report.add("usd-variant", message, where, help=help)
