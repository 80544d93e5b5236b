"""Primvars of meshes as attributes: normals, colours, and what textures ask for.

Only what the materials of a mesh name is read, normals that are honoured, and colours that vary
within faces.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, UsdGeom

from compiler.usd.appearance import Base
from compiler.usd.clock import Clock, numbers
from compiler.usd.prims import Authored
from compiler.usd.refinement import Refinement
from compiler.usd.report import Report
from compiler.usd.surfaces import MeshSurface
from dsl.scene import Material, MeshAttribute

Rows = NDArray[np.integer]


class Primvars:
    """Reads the primvars of a stage's meshes; `read` has the paths of those that materials name."""

    def __init__(self, clock: Clock, report: Report) -> None:
        self._clock = clock
        self._report = report
        self.read: set[Sdf.Path] = set()

    def of_surface(
        self,
        prim: Any,
        authored: Authored,
        surface: MeshSurface,
        materials: Iterable[Material | None],
    ) -> tuple[MeshAttribute, ...]:
        """The attributes of a mesh that is drawn in these materials."""
        textures = [texture for m in materials if m is not None for texture in m.textures]
        named = {texture.attribute: None for texture in textures if texture.attribute}
        found = [self._normals(prim, authored, surface)]
        for name in named:
            primvar = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(name)
            if primvar and primvar.HasValue():
                self.read.add(primvar.GetAttr().GetPath())
                values = self._clock.value(primvar.GetAttr())
                indices = self._indices(primvar)
                token = str(primvar.GetInterpolation())
                found.append(self._attribute(prim, name, values, indices, token, surface))
        return tuple(attribute for attribute in found if attribute is not None)

    def _normals(self, prim: Any, authored: Authored, surface: MeshSurface) -> MeshAttribute | None:
        """Those of a limit surface, or authored ones of a polygon mesh; primvars come first."""
        limit = surface.refinement
        if limit is not None and limit.normals is not None and limit.corner_normals is not None:
            normals = np.asarray(-limit.normals if surface.turned else limit.normals, np.float32)
            return MeshAttribute(
                "normals", normals, limit.corner_normals[surface.cut.places].astype(np.int32)
            )
        if "primvars:normals" not in authored and "normals" not in authored:
            return None
        if self._clock.token(prim.GetAttribute("subdivisionScheme")) != "none":
            return None
        primvar = UsdGeom.PrimvarsAPI(prim).GetPrimvar("normals")
        if primvar and primvar.HasAuthoredValue():
            values, indices = self._clock.value(primvar.GetAttr()), self._indices(primvar)
            token = str(primvar.GetInterpolation())
        elif prim.GetAttribute("normals").HasAuthoredValue():
            values, indices = self._clock.value(prim.GetAttribute("normals")), None
            token = str(UsdGeom.Mesh(prim).GetNormalsInterpolation())
        else:
            return None
        if surface.posed:
            self._ignore(prim, "normals", "does not move with its skinned mesh")
            return None
        found = self._attribute(prim, "normals", values, indices, token, surface)
        return found if found is not None and found.values.shape[1] == 3 else None

    def _indices(self, primvar: Any) -> Rows | None:
        if not primvar.IsIndexed():
            return None
        indices = self._clock.integers(primvar.GetIndicesAttr())
        return np.empty(0, np.int64) if indices is None else indices

    def _attribute(
        self,
        prim: Any,
        name: str,
        value: Any,
        indices: Rows | None,
        interpolation: str,
        surface: MeshSurface,
    ) -> MeshAttribute | None:
        """An attribute from a primvar's values, or None (reported) where they do not fit."""
        values = _table(value)
        if values is None or not np.isfinite(values).all():
            self._ignore(prim, name, "holds no finite numbers")
            return None
        rows = np.arange(len(values)) if indices is None else indices
        if len(rows) and (rows.min() < 0 or rows.max() >= len(values)):
            self._ignore(prim, name, "has indices out of range")
            return None
        limit = surface.refinement
        if limit is not None and interpolation in ("vertex", "varying", "faceVarying"):
            if (found := _refined(name, values, rows, interpolation, limit, surface)) is not None:
                return found
        elif interpolation in ("vertex", "varying") and len(rows) == len(surface.points):
            return MeshAttribute(name, values if indices is None else values[rows])
        elif interpolation == "faceVarying" and len(rows) > surface.cut.places.max(initial=-1):
            return MeshAttribute(name, values, rows[surface.cut.places].astype(np.int32))
        if interpolation == "uniform" and len(rows) == surface.face_count:
            each = rows[surface.cut.faces].astype(np.int32)
            return MeshAttribute(name, values, np.repeat(each[:, None], 3, axis=1))
        if interpolation == "constant" and len(rows):
            each = np.full((len(surface.cut.faces), 3), rows[0], np.int32)
            return MeshAttribute(name, values, each)
        self._ignore(prim, name, f"has a wrong number of values for `{interpolation}`")
        return None

    def _ignore(self, prim: Any, name: str, why: str) -> None:
        message = f"the primvar `{name}` {why}, and is ignored"
        self._report.add("usd-primvar", message, prim.GetPath())


def inherits(prim: Any, names: Iterable[str], base: Base) -> bool:
    """Whether a primvar of these names comes to a prim from the root of an instance, or above."""
    primvars = UsdGeom.PrimvarsAPI(prim)
    found = (primvars.FindPrimvarWithInheritance(name) for name in names)
    return any(
        primvar and not base.owns(primvar.GetAttr().GetPrim().GetPath()) for primvar in found
    )


def _refined(
    name: str,
    values: NDArray[np.float32],
    rows: Rows,
    interpolation: str,
    limit: Refinement,
    surface: MeshSurface,
) -> MeshAttribute | None:
    """An attribute of a refined mesh, or None if the number of `rows` does not fit."""
    exact = values.astype(np.float64)
    if interpolation == "faceVarying":
        if len(rows) <= limit.places.max(initial=-1):
            return None
        of_corners = exact[rows[limit.places]]
    elif len(rows) != limit.cage.topology.point_count:
        return None
    elif interpolation == "vertex":
        return MeshAttribute(name, limit.points(exact[rows]).astype(np.float32))
    else:
        of_corners = exact[rows][limit.cage.topology.corners]
    refined = limit.corners(of_corners).astype(np.float32)
    return MeshAttribute(name, refined, surface.cut.places.astype(np.int32))


def _table(value: Any) -> NDArray[np.float32] | None:
    """Rows of numbers `(k, w)`, or None for what is not that."""
    array = numbers(value)
    if array is None or array.ndim not in (1, 2) or not array.size:
        return None
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(array.reshape(len(array), -1), dtype=np.float32)
