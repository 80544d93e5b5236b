"""Skinned meshes: points moved by the joints of a skeleton at one time.

Linear blend skinning: a point, brought into the skeleton's space as it was bound, goes to the mean
of where its joints take it, by its weights as authored (UsdSkel, "Skinning").
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdSkel

from compiler.usd.clock import Clock
from compiler.usd.report import Report
from compiler.usd.xform import world_matrix
from dsl.scene import FloatArray

_EVERYTHING = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)


def is_skinned(prim: Any) -> bool:
    """Whether a prim says which joints move its points."""
    return bool(prim.GetAttribute("primvars:skel:jointIndices").HasAuthoredValue())


class Skinning:
    """Poses the meshes of a stage."""

    def __init__(self, clock: Clock, report: Report) -> None:
        self._clock = clock
        self._report = report
        self._cache = UsdSkel.Cache()
        self._skeletons: dict[Sdf.Path, dict[Sdf.Path, Any]] = {}

    def posed(self, prim: Any, points: FloatArray) -> FloatArray:
        """The points `(n, 3)` of a skinned mesh in its own space; in rest where that fails."""
        path = prim.GetPath()
        if prim.GetRelationship("skel:blendShapeTargets").HasAuthoredTargets():
            self._report.add("usd-skinning", "blend shapes are not used", path)
        skeleton = self._skeleton(prim)
        query = self._cache.GetSkinningQuery(prim) if skeleton else None
        bones = self._cache.GetSkelQuery(skeleton) if skeleton else None
        if not query or not bones:
            self._report.add("usd-skinning", "meshes without a skeleton stay as they are", path)
            return points
        if query.GetSkinningMethod() != UsdSkel.Tokens.classicLinear:
            self._report.add("usd-skinning", "dual quaternions are replaced by linear blends", path)
        joints = self._joints(query, bones)
        time = self._clock.code(query.GetJointIndicesPrimvar().GetAttr())
        found = query.ComputeVaryingJointInfluences(len(points), time)
        per_point = query.GetNumInfluencesPerComponent()
        indices, weights = (np.array(a).reshape(-1, max(per_point, 1)) for a in found or ((), ()))
        outside = not len(joints) or indices.min(initial=0) < 0
        if len(indices) != len(points) or outside or indices.max(initial=0) >= len(joints):
            message = "meshes whose joints or weights do not fit stay as they are"
            self._report.add("usd-skinning", message, path)
            return points
        bound = _moved(points, np.array(query.GetGeomBindTransform(time)))
        posed = np.zeros_like(points)
        for joint, weight in zip(indices.T, weights.T, strict=True):
            linear, offset = joints[joint, :3, :3], joints[joint, 3, :3]
            posed += weight[:, None] * (np.einsum("ni,nij->nj", bound, linear) + offset)
        world = world_matrix(skeleton.GetPrim(), self._clock)
        return _moved(posed, np.array(world * world_matrix(prim, self._clock).GetInverse()))

    def _joints(self, query: Any, bones: Any) -> FloatArray:
        """Where the joints of a mesh take points, `(j, 4, 4)` for row vectors; none if unknown."""
        animation = bones.GetAnimQuery()
        time = Usd.TimeCode.Default()
        if animation:
            time = self._clock.code(animation.GetPrim().GetAttribute("rotations"))
        transforms = bones.ComputeSkinningTransforms(time)
        joints = np.array(transforms, dtype=np.float64).reshape(-1, 4, 4)
        names = query.GetJointOrder()
        if not names:
            return joints
        rows = {name: row for row, name in enumerate(bones.GetJointOrder())}
        chosen = [rows.get(name, len(joints)) for name in names]
        return joints[chosen] if max(chosen) < len(joints) else joints[:0]

    def _skeleton(self, prim: Any) -> Any:
        """The skeleton that a prim is bound to, None where there is none."""
        root = UsdSkel.Root.Find(prim)
        if not root:
            return None
        path = root.GetPath()
        if path not in self._skeletons:
            self._cache.Populate(root, _EVERYTHING)
            self._skeletons[path] = {
                query.GetPrim().GetPath(): binding.GetSkeleton()
                for binding in self._cache.ComputeSkelBindings(root, _EVERYTHING)
                for query in binding.GetSkinningTargets()
            }
        return self._skeletons[path].get(prim.GetPath())


def _moved(points: FloatArray, matrix: FloatArray) -> FloatArray:
    return np.asarray(points @ matrix[:3, :3] + matrix[3, :3])
