"""What a stage says of its prims and nothing here listens to.

Only what a schema gives a meaning is looked at, and primvars; other attributes are their author's
own. A value that is the schema's fallback says nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from typing import Any

import numpy as np
from pxr import Sdf

from compiler.usd.clock import Clock
from compiler.usd.prims import Authored, PrimType
from compiler.usd.report import Report
from compiler.usd.schema import BEVEL, EXACT_POINTS, EXACT_TRANSFORMS, SOLIDS, type_name

_LIGHT = {
    "inputs:color",
    "inputs:colorTemperature",
    "inputs:enableColorTemperature",
    "inputs:exposure",
    "inputs:intensity",
    "inputs:normalize",
    "light:filters",
    "light:shaderId",
}
_SHAPING = {
    "inputs:shaping:cone:angle",
    "inputs:shaping:cone:softness",
    "inputs:shaping:focus",
}
_DOME = {"guideRadius", "inputs:texture:file", "inputs:texture:format"}
_FRAME = {
    "aspectRatioConformPolicy",
    "camera",
    "dataWindowNDC",
    "disableDepthOfField",  # pictures have none
    "disableMotionBlur",
    "instantaneousShutter",
    "pixelAspectRatio",
    "resolution",
}
_READ: dict[str, set[str]] = {
    "": {"primvars:widths"},  # which curves and points below may inherit
    "Scope": {"primvars:widths"},
    "Xform": {"primvars:widths"},
    "Material": {"outputs:surface"},
    "Shader": {"info:id", "info:implementationSource"},
    "NodeGraph": set(),
    "GeomSubset": {"elementType", "familyName", "indices"},
    "BlendShape": {"offsets", "pointIndices"},
    "HermiteCurves": {"curveVertexCounts", "points", "primvars:widths", "tangents", "widths"},
    "TetMesh": {"orientation", "points", "surfaceFaceVertexIndices", "tetVertexIndices"},
    "BasisCurves": {
        "basis",
        "curveVertexCounts",
        "points",
        "primvars:widths",
        "type",
        "widths",
        "wrap",
    },
    "NurbsCurves": {
        "curveVertexCounts",
        "knots",
        "order",
        "points",
        "pointWeights",
        "primvars:widths",
        "ranges",
        "widths",
    },
    "NurbsPatch": {
        "points",
        "pointWeights",
        "uForm",  # what is closed has the same points at both ends
        "uKnots",
        "uOrder",
        "uRange",
        "uVertexCount",
        "vForm",
        "vKnots",
        "vOrder",
        "vRange",
        "vVertexCount",
        *(
            f"trimCurve:{name}"
            for name in ("counts", "knots", "orders", "points", "ranges", "vertexCounts")
        ),
    },
    "Points": {"ids", "points", "primvars:widths", "widths"},
    "SkelRoot": set(),
    "Skeleton": {"bindTransforms", "jointNames", "joints", "restTransforms"},
    "SkelAnimation": {
        "blendShapeWeights",
        "blendShapes",
        "joints",
        "rotations",
        "scales",
        "translations",
    },
    "Backdrop": {"ui:description"},
    "Camera": {
        "clippingPlanes",
        "clippingRange",
        "exposure",
        "exposure:fStop",
        "exposure:iso",
        "exposure:responsivity",
        "exposure:time",
        "ovolo:clippingRange",
        "ovolo:freeAspect",
        "fStop",
        "focalLength",
        "focusDistance",
        "horizontalAperture",
        "horizontalApertureOffset",
        "projection",
        "shutter:close",
        "shutter:open",
        "verticalAperture",
        "verticalApertureOffset",
    },
    "Capsule": {"axis", "height", "radius"},
    "Capsule_1": {"axis", "height", "radiusBottom", "radiusTop"},
    "Cone": {"axis", "height", "radius", BEVEL},
    "Cube": {"size", BEVEL},
    "Cylinder": {"axis", "height", "radius", BEVEL},
    "Cylinder_1": {"axis", "height", "radiusBottom", "radiusTop"},
    "Plane": {"axis", "length", "width"},
    "RenderSettings": {
        *_FRAME,
        "includedPurposes",
        "ovolo:exposure",
        "ovolo:integrator",
        "ovolo:occlusionDistance",
        "ovolo:precision",
        "ovolo:samples",
        "products",
    },
    "RenderProduct": {*_FRAME, "orderedVars", "productName", "productType"},
    "RenderVar": {"dataType", "sourceName", "sourceType"},
    "Sphere": {"radius"},
    "Mesh": {
        EXACT_POINTS,
        "cornerIndices",
        "cornerSharpnesses",
        "creaseIndices",
        "creaseLengths",
        "creaseSharpnesses",
        "faceVertexCounts",
        "faceVertexIndices",
        "holeIndices",
        "interpolateBoundary",
        "normals",
        "orientation",
        "points",
        "subdivisionScheme",
        "triangleSubdivisionRule",
    },
    "PointInstancer": {
        EXACT_TRANSFORMS,
        "ids",
        "invisibleIds",
        "orientations",
        "orientationsf",
        "positions",
        "protoIndices",
        "prototypes",
        "scales",
    },
    "DistantLight": {*_LIGHT, "inputs:angle"},
    "SphereLight": {*_LIGHT, *_SHAPING, "inputs:radius", "treatAsPoint"},
    "RectLight": {*_LIGHT, *_SHAPING, "inputs:height", "inputs:width"},
    "DiskLight": {*_LIGHT, *_SHAPING, "inputs:radius"},
    "CylinderLight": {*_LIGHT, *_SHAPING, "inputs:length", "inputs:radius", "treatAsLine"},
    "DomeLight": {*_LIGHT, *_DOME},
    "DomeLight_1": {*_LIGHT, *_DOME, "poleAxis"},
    **{
        # The points and faces are for those who do not know the solid.
        type_name(kind): {
            "faceVertexCounts",
            "faceVertexIndices",
            "points",
            "subdivisionScheme",
            *(parameter.name for parameter in parameters),
        }
        for kind, parameters in SOLIDS.items()
    },
}
"""Types that are understood, and what is read of each, or reported by its reader."""

_OF_ALL = {
    "doubleSided",  # surfaces are hit from both sides
    "extent",
    "extentsHint",
    "model:applyDrawMode",
    "model:cardGeometry",
    "model:drawMode",
    "model:drawModeColor",
    "orientation",  # of a quadric, whose outside is outside
    "primvars:displayColor",
    "primvars:displayOpacity",
    "proxyPrim",
    "purpose",
    "visibility",
    "xformOpOrder",
}
_ELSEWHERE = (
    "material:binding",
    "physics:",
    "primvars:skel:",
    "skel:",
    "ui:",
    "xformOp:",
)
"""Namespaces that are read elsewhere, or that no picture depends on."""

_GIVEN = {"Ci", "C", "Cd", "rgb", "rgba", "color", "a", "alpha", "z", "Z", "depth", "N", "normal"}
"""Names of render vars that every .exr file has: colour, alpha, depth and normals."""

_MENDS = {
    "inputs:shaping:focusTint": "a light has one colour: `inputs:color`",
    "inputs:shaping:ies": (
        "shape the light by `shaping:cone:angle`, `shaping:cone:softness` and `shaping:focus`"
    ),
    "inputs:texture:file": "set `inputs:color` to the mean of the texture",
}
"""What to say instead, by the beginnings of names."""


class Unused:
    """Reports what is authored and has no effect, prim by prim."""

    def __init__(self, clock: Clock, report: Report) -> None:
        self._clock = clock
        self._report = report
        self._suspects: dict[tuple[PrimType, Authored], tuple[str, ...]] = {}
        self._passed_on: list[tuple[Sdf.Path, str]] = []

    def check(
        self, prim: Any, type: PrimType, authored: Authored, named: Collection[str] = ()
    ) -> None:
        """Report the unread of a prim's authored properties, if its type is known.

        Primvars that the materials of a mesh have `named` are read, and so are its normals.
        A prim whose whole type is unknown here is reported once, as a whole.
        """
        kind = type.kind
        read = _READ.get(kind)
        if read is None:
            # Surfaces, lights and types of no schema are reported by whoever does not draw them.
            if type.known and not type.boundable and not type.light:
                self._report.add("usd-unused", f"`{kind}` prims are not used", prim.GetPath())
            return
        if kind == "RenderVar" and self._clock.token(prim.GetAttribute("sourceName")) not in _GIVEN:
            message = "a `RenderVar` of another `sourceName` is not rendered"
            help = "an .exr file has `rgba`, `depth` and `normal`, and the numbers of instances"
            self._report.add("usd-unused", message, prim.GetPath(), help)
        suspects = self._suspects.get((type, authored))
        if suspects is None:
            suspects = self._suspects[type, authored] = tuple(
                name
                for name in _meaningful(prim, kind, authored.names)
                if name not in read and name not in _OF_ALL and not name.startswith(_ELSEWHERE)
            )
        for name in suspects:
            if name == "primvars:normals" and kind == "Mesh" and not self._is_smooth(prim):
                continue
            if name.removeprefix("primvars:") in named:
                continue
            if not self._says_something(prim, name):
                continue
            if name.startswith("primvars:"):
                what = f"primvar `{name.removeprefix('primvars:')}`"
                if not type.gprim:
                    self._passed_on.append((prim.GetPath().AppendProperty(name), what))
                    continue
            else:
                what = f"`{name}` of `{kind}` prims"
            mend = next((_MENDS[begin] for begin in _MENDS if name.startswith(begin)), None)
            self._report.add("usd-unused", f"{what} is not used", prim.GetPath(), mend)

    def check_passed_on(self, read: Collection[Sdf.Path]) -> None:
        """Report the primvars of prims that only pass them on, but for those `read` below."""
        for path, what in self._passed_on:
            if path not in read:
                self._report.add("usd-unused", f"{what} is not used", path.GetPrimPath())

    def _is_smooth(self, prim: Any) -> bool:
        """Whether a mesh is a subdivision surface, whose normals USD says to ignore."""
        return self._clock.token(prim.GetAttribute("subdivisionScheme")) != "none"

    def _says_something(self, prim: Any, name: str) -> bool:
        attribute = prim.GetAttribute(name)
        if not attribute:
            return bool(prim.GetRelationship(name).HasAuthoredTargets())
        if attribute.HasAuthoredConnections():
            return True
        value = self._clock.value(attribute)
        if value is None:
            return False
        if not isinstance(value, str) and np.ndim(value) and not len(value):
            return False
        fallback = prim.GetPrimDefinition().GetAttributeFallbackValue(name)
        return fallback is None or not np.array_equal(value, fallback)


def _meaningful(prim: Any, kind: str, authored: Iterable[str]) -> Iterator[str]:
    """What is authored and has a meaning by the prim's schemas, or is a primvar."""
    schemas = (kind, *prim.GetAppliedSchemas())
    meant = frozenset(prim.GetPrimDefinition().GetPropertyNames())
    light = any(schema.endswith("LightAPI") for schema in schemas) or kind.endswith("Light")
    for name in authored:
        if name.startswith("primvars:"):
            if not name.endswith((":indices", ":lengths")):
                yield name
        elif name in meant and (light or not name.startswith("collection:")):
            yield name
