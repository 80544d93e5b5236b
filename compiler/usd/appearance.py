"""Which material a prim is drawn in.

A binding that usd-core resolves for a prim may be authored on it or on any ancestor. Within a
native instance only what is authored below the instance's root belongs to the shared prototype;
what comes from above is bound at the instance instead, and inherited in the scene graph.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade

from compiler.usd.clock import Clock
from compiler.usd.materials import Materials
from compiler.usd.report import Report
from dsl.scene import DEFAULT_MATERIAL, FloatArray, Material, Texture

FACE_COLORS = 256
"""Distinct colours per face up to which a mesh is split by colour; beyond, they vary over it."""


@dataclass(frozen=True, slots=True)
class Binding:
    """What usd-core resolved for a prim: the material, and where and by what it is bound."""

    material: Material
    source: Sdf.Path
    relationship: Sdf.Path = field(compare=False)


@dataclass(frozen=True, slots=True)
class Base:
    """The root of the innermost native instance around a prim, or the stage's.

    `binding` is that root's own: what is below inherits it. `outside` says that a native instance
    shows prims that are not below it: prototypes of a point instancer in it.
    """

    path: Sdf.Path = Sdf.Path.absoluteRootPath
    binding: Binding | None = None
    outside: bool = False

    def of_prototype(self, path: Sdf.Path) -> Base:
        """The base of a point instancer's prototype, where the instancer has this one."""
        return self if path.HasPrefix(self.path) else Base(outside=True)

    def owns(self, path: Sdf.Path) -> bool:
        """Whether a path is strictly below; everything is below the stage's root."""
        return bool(path.HasPrefix(self.path) and path != self.path)

    def own(self, binding: Binding) -> Material | None:
        """The material of a binding, or None where it is inherited from the base.

        A collection above may also bind a prim below and not the base itself.
        """
        inherited = binding == self.binding and not self.owns(binding.source)
        return None if inherited else binding.material

    def label(self, text: str) -> str:
        """The text of a path relative to the base."""
        if self.outside:
            return f"/{text}"
        return text if self.path.IsAbsoluteRootPath() else text[len(str(self.path)) :]


@dataclass(frozen=True, slots=True)
class Display:
    """A prim's displayColor and displayOpacity.

    `colors` `(k, 3)` with `faces` the colour of each face, or one colour and no faces. `below`
    says that some of it is authored below the frame's base, or hides a material from above it,
    `above` that some is not. `textures` give what varies within faces, of which the one colour,
    and the opacity, are means.
    """

    colors: FloatArray
    faces: np.ndarray[Any, np.dtype[np.int64]] | None
    opacity: float
    below: bool
    above: bool
    textures: tuple[Texture, ...] = ()

    def material(self, index: int = 0) -> Material:
        """The material of one colour."""
        r, g, b = (float(x) for x in self.colors[index])
        return Material(diffuse=(r, g, b), opacity=self.opacity, textures=self.textures)


class Appearance:
    """Looks up bindings and display colours of one stage."""

    def __init__(self, clock: Clock, report: Report) -> None:
        self._clock = clock
        self._report = report
        self._materials = Materials(clock, report)
        self._bindings: dict[Sdf.Path, Binding | None] = {}
        self._by_source: dict[Sdf.Path, Binding | None] = {}
        self._hiding: set[Sdf.Path] = set()  # prims whose binding is to no material

    def resolve(self, prims: dict[Sdf.Path, Any], *, previews: bool = True) -> None:
        """Resolve the bindings of many prims, by path, at once, which is how usd-core can cache.

        Of bindings for several purposes, full comes before preview, and preview before all. Without
        `previews` there is no binding for preview, on the prims or above.
        """
        unknown = {path: prim for path, prim in prims.items() if path not in self._bindings}
        full, preview = UsdShade.Tokens.full, UsdShade.Tokens.preview
        for purpose in (full, preview) if previews else (full,):
            if not unknown:
                return
            found = UsdShade.MaterialBindingAPI.ComputeBoundMaterials([*unknown.values()], purpose)
            left = {}
            for path, material, source in zip(unknown, *found, strict=True):
                own = bool(source) and previews and _purpose(source) == purpose
                # Each answer falls back to bindings for all purposes; preview comes before those.
                if own or path not in self._bindings:
                    self._bindings[path] = self._binding(material, source)
                    if source and not material:
                        self._hiding.add(path)
                if not own:
                    left[path] = unknown[path]
            unknown = left

    def _binding(self, material: Any, source: Any) -> Binding | None:
        if not source:
            return None
        path = source.GetPath()
        if path not in self._by_source:
            self._by_source[path] = self._read(material, source, path)
        return self._by_source[path]

    def _read(self, material: Any, source: Any, path: Sdf.Path) -> Binding | None:
        prim = path.GetPrimPath()
        if material:
            return Binding(self._materials.read(material), prim, path)
        if any(map(partial(_is_missing, source.GetStage()), source.GetTargets())):
            message = "a binding to what is no material is not used"
            self._report.add("usd-material", message, prim)
        return None

    def is_strong(self, stage: Any, binding: Binding | None) -> bool:
        """Whether a binding is stronger than those of prims below."""
        if binding is None:
            return False
        strength = UsdShade.MaterialBindingAPI.GetMaterialBindingStrength(
            stage.GetRelationshipAtPath(binding.relationship)
        )
        return bool(strength == UsdShade.Tokens.strongerThanDescendants)

    def binding(self, prim: Any) -> Binding | None:
        """The binding of a prim; fastest if `resolve` saw the prim before."""
        path = prim.GetPath()
        if path not in self._bindings:
            self.resolve({path: prim})
        return self._bindings[path]

    def subsets(self, prim: Any) -> list[Any]:
        """The subsets of a mesh's faces that may have materials, below an instance's root too."""
        below = prim.GetFilteredChildren(Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate))
        found = []
        for subset in (UsdGeom.Subset(child) for child in below if child.IsA(UsdGeom.Subset)):
            bound = UsdShade.MaterialBindingAPI(subset.GetPrim()).GetDirectBindingRel()
            kind = self._clock.token(subset.GetElementTypeAttr())
            family = self._clock.token(subset.GetFamilyNameAttr())
            if kind == UsdGeom.Tokens.face and family == UsdShade.Tokens.materialBind:
                found.append(subset)
            elif bound and bound.GetTargets():
                message = f"materials of `{kind}` subsets of the family `{family}` are not used"
                self._report.add("usd-material", message, subset.GetPath())
        return found

    def attributes(self, own: Binding | None, subsets: Iterable[Any]) -> frozenset[str]:
        """The attributes that a mesh's `own` material and those of subsets of its faces read."""
        bound = [own, *(self.binding(subset.GetPrim()) for subset in subsets)]
        textures = [texture for each in bound if each for texture in each.material.textures]
        return frozenset(texture.attribute for texture in textures)

    def display(self, prim: Any, base: Base, *, colored: bool, bound: bool) -> Display | None:
        """How a prim without a material is drawn, or None if it says nothing of that.

        It says so by a colour or opacity, if it may be `colored`, and by a binding to what is no
        material, if it may be `bound`: that hides those of prims above.
        """
        hides = bound and prim.GetPath() in self._hiding
        found = self._display(prim, base) if colored else None
        if not hides:
            return found
        if found is None:
            return Display(np.array([DEFAULT_MATERIAL.diffuse]), None, 1.0, below=True, above=False)
        return replace(found, below=True)

    def _display(self, prim: Any, base: Base) -> Display | None:
        primvars = UsdGeom.PrimvarsAPI(prim)
        color = primvars.FindPrimvarWithInheritance("displayColor")
        opacity = primvars.FindPrimvarWithInheritance("displayOpacity")
        found = [primvar for primvar in (color, opacity) if primvar and primvar.HasValue()]
        if not found:
            return None
        below = [base.owns(primvar.GetAttr().GetPrim().GetPath()) for primvar in found]
        colors, faces = self._colors(color, prim)
        textures = []
        if self._varies("displayColor", color, faces is not None, prim):
            textures.append(Texture("diffuse", "", "displayColor"))
        if self._varies("displayOpacity", opacity, False, prim):
            textures.append(Texture("opacity", "", "displayOpacity"))
        return Display(
            colors,
            faces,
            self._opacity(opacity, prim),
            any(below),
            not all(below),
            tuple(textures),
        )

    def _varies(self, name: str, primvar: Any, by_face: bool, prim: Any) -> bool:
        """Whether a mesh's attribute is to give a value; reported where others are drawn as one."""
        if not primvar or not primvar.HasValue() or by_face:
            return False
        interpolation = _interpolation(primvar, prim)
        value = self._clock.value(primvar.GetAttr())
        if interpolation == UsdGeom.Tokens.constant or np.ndim(value) == 0 or len(value) < 2:
            return False
        if prim.IsA(UsdGeom.Mesh):
            return True
        message = f"a {name} of interpolation `{interpolation}` is drawn as its mean"
        self._report.add("usd-primvar", message, prim.GetPath())
        return False

    def _colors(
        self, primvar: Any, prim: Any
    ) -> tuple[FloatArray, np.ndarray[Any, np.dtype[np.int64]] | None]:
        default = np.array([DEFAULT_MATERIAL.diffuse])
        if not primvar or not primvar.HasValue():
            return default, None
        values = self._clock.vectors(primvar.GetAttr(), 3)
        if values is None or not len(values) or not np.isfinite(values).all():
            message = "a displayColor that holds no finite colours is ignored"
            self._report.add("usd-primvar", message, prim.GetPath())
            return default, None
        indices = self._indices(primvar, len(values), prim)
        if indices is not None:
            values = values[indices]
        if len(values) == 1:
            return values, None
        interpolation = _interpolation(primvar, prim)
        if interpolation == UsdGeom.Tokens.constant:
            return values[:1], None
        if interpolation == UsdGeom.Tokens.uniform and prim.IsA(UsdGeom.Mesh):
            colors, faces = np.unique(values, axis=0, return_inverse=True)
            if len(colors) <= FACE_COLORS:
                return colors, faces.reshape(-1).astype(np.int64)
        return values.mean(axis=0, keepdims=True), None

    def _indices(self, primvar: Any, count: int, prim: Any) -> Any:
        if not primvar.IsIndexed():
            return None
        indices = self._clock.integers(primvar.GetIndicesAttr())
        if indices is not None and len(indices) and ((indices >= 0) & (indices < count)).all():
            return indices
        message = "a displayColor with indices out of range is read without them"
        self._report.add("usd-primvar", message, prim.GetPath())
        return None

    def _opacity(self, primvar: Any, prim: Any) -> float:
        if not primvar or not primvar.HasValue():
            return 1.0
        value = self._clock.value(primvar.GetAttr())
        values = np.atleast_1d(np.asarray(value)) if value is not None else np.empty(0)
        if values.dtype.kind not in "fiu" or not values.size or not np.isfinite(values).all():
            message = "a displayOpacity that holds no finite numbers is ignored"
            self._report.add("usd-primvar", message, prim.GetPath())
            return 1.0
        return float(np.clip(values.mean(), 0.0, 1.0))


def _interpolation(primvar: Any, prim: Any) -> str:
    """How a primvar varies; one that is uniform is one value for a point instancer, as USD says."""
    own = str(primvar.GetInterpolation())
    one = own == UsdGeom.Tokens.uniform and prim.IsA(UsdGeom.PointInstancer)
    return str(UsdGeom.Tokens.constant) if one else own


def _is_missing(stage: Any, path: Sdf.Path) -> bool:
    """Whether a target is no material, and not for want of a layer, which is reported as that."""
    if not path.IsAbsoluteRootOrPrimPath():
        return False
    found = stage.GetPrimAtPath(path)
    if found:
        return not found.IsA(UsdShade.Material)
    while not found:
        path = path.GetParentPath()
        found = stage.GetPrimAtPath(path)
    return not (found.HasAuthoredReferences() or found.HasAuthoredPayloads())


def _purpose(source: Any) -> str:
    """The purpose in the name of a binding, empty for all purposes."""
    parts = source.GetName().split(":")
    if parts[2:3] == ["collection"]:
        return parts[3] if len(parts) == 5 else ""
    return parts[2] if len(parts) == 3 else ""
