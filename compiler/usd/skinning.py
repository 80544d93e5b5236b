"""Skinned meshes: points moved by the joints of a skeleton at one time.

Blend shapes come first, by the weights of the animation. Linear blend skinning: a point, brought
into the skeleton's space as it was bound, goes to the mean of where its joints take it, by its
weights as authored (UsdSkel, "Skinning").
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdSkel, Vt

from compiler.usd.clock import Clock
from compiler.usd.prims import Authored
from compiler.usd.report import Report
from compiler.usd.xform import world_matrix
from dsl.scene import FloatArray, Step, StepKind

_JOINTS = "skel:jointIndices"
_BLEND_SHAPES = "skel:blendShapeTargets"
_EVERYTHING = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)


def is_skinned(prim: Any, authored: Authored, below_root: bool) -> bool:
    """Whether joints or blend shapes move a prim; below a SkelRoot it inherits joints."""
    own = f"primvars:{_JOINTS}" in authored or _BLEND_SHAPES in authored
    if not below_root and not own:
        return False
    if below_root:
        joints = UsdGeom.PrimvarsAPI(prim).FindPrimvarWithInheritance(_JOINTS)
    else:
        joints = UsdGeom.PrimvarsAPI(prim).GetPrimvar(_JOINTS)
    return bool(
        (joints and joints.HasAuthoredValue())
        or prim.GetRelationship(_BLEND_SHAPES).HasAuthoredTargets()
    )


class Skinning:
    """Poses the meshes of a stage."""

    def __init__(self, clock: Clock, report: Report) -> None:
        self._clock = clock
        self._report = report
        self._cache = UsdSkel.Cache()
        self._skeletons: dict[Sdf.Path, dict[Sdf.Path, Any]] = {}

    def steps(self, prim: Any) -> tuple[Step, ...]:
        """How a prim is moved that all points of have the same joints; none (reported) if not."""
        query = self._cache.GetSkinningQuery(prim) if self._skeleton(prim) else None
        if query and query.HasJointInfluences() and not query.IsRigidlyDeformed():
            message = (
                "prims other than meshes whose points have joints of their own stay as they are"
            )
            self._report.add("usd-skinning", message, prim.GetPath())
            return ()
        frame = np.concatenate((np.zeros((1, 3)), np.eye(3)))
        origin, *ends = self.posed(prim, frame)
        columns = [*(end - origin for end in ends), origin]
        return (Step(StepKind.MATRIX, np.stack(columns, axis=1).ravel()),)

    def posed(self, prim: Any, points: FloatArray) -> FloatArray:
        """The points `(n, 3)` of a skinned prim in its own space; in rest where that fails."""
        path = prim.GetPath()
        skeleton = self._skeleton(prim)
        query = self._cache.GetSkinningQuery(prim) if skeleton else None
        bones = self._cache.GetSkelQuery(skeleton) if skeleton else None
        if not query or not bones:
            self._report.add(
                "usd-skinning", "skinned prims without a skeleton stay as they are", path
            )
            return points
        points = self._blended(prim, query, bones, points)
        if not query.HasJointInfluences():
            return points
        world, own = (
            world_matrix(p, self._clock, self._report) for p in (skeleton.GetPrim(), prim)
        )
        if not own.GetDeterminant():
            message = "skinned prims that their transform presses flat stay as they are"
            self._report.add("usd-skinning", message, path)
            return points
        skeleton_to_mesh = np.array(world * own.GetInverse())
        if query.GetSkinningMethod() == UsdSkel.Tokens.dualQuaternion:
            return _moved(self._by_dual_quaternions(query, bones, points), skeleton_to_mesh)
        joints = self._joints(query, bones, path)
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
        return _moved(posed, skeleton_to_mesh)

    def _blended(self, prim: Any, query: Any, bones: Any, points: FloatArray) -> FloatArray:
        """The points moved by blend shapes and their inbetweens."""
        animation = bones.GetAnimQuery()
        if not query.HasBlendShapes() or not animation:
            return points
        time = self._clock.code(animation.GetPrim().GetAttribute("blendShapeWeights"))
        found = animation.ComputeBlendShapeWeights(time)
        weights = dict(zip(animation.GetBlendShapeOrder(), found or (), strict=False))
        shapes = UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(prim))
        named = Vt.FloatArray([weights.get(name, 0.0) for name in query.GetBlendShapeOrder()])
        parts = shapes.ComputeSubShapeWeights(named)
        if not parts:
            message = "meshes whose blend shapes do not fit their weights are not blended"
            self._report.add("usd-skinning", message, prim.GetPath())
            return points
        offsets = [np.array(o) for o in shapes.ComputeSubShapePointOffsets()]
        rows = [np.array(i, dtype=np.int64) for i in shapes.ComputeBlendShapePointIndices()]
        points = points.copy()
        for weight, shape, part in zip(*parts, strict=True):
            moved = rows[shape] if len(rows[shape]) else np.arange(len(points))
            own = offsets[part].reshape(-1, 3)
            fits = len(own) == len(moved) and not ((moved < 0) | (moved >= len(points))).any()
            if fits and np.isfinite(own).all():
                np.add.at(points, moved, weight * own)
            elif len(own):
                message = "blend shapes whose offsets do not fit the points are left out"
                self._report.add("usd-skinning", message, prim.GetPath())
        return points

    def _by_dual_quaternions(self, query: Any, bones: Any, points: FloatArray) -> FloatArray:
        """Points in the skeleton's space, skinned by usd-core in single precision."""
        moved = Vt.Vec3fArray.FromNumpy(points.astype(np.float32))
        time = self._clock.code(query.GetJointIndicesPrimvar().GetAttr())
        transforms = bones.ComputeSkinningTransforms(self._time(bones))
        if query.ComputeSkinnedPoints(transforms, moved, time):
            return np.array(moved, dtype=np.float64)
        message = "meshes whose joints or weights do not fit stay as they are"
        self._report.add("usd-skinning", message, query.GetPrim().GetPath())
        return points

    def _time(self, bones: Any) -> Any:
        animation = bones.GetAnimQuery()
        if not animation:
            return Usd.TimeCode.Default()
        return self._clock.code(animation.GetPrim().GetAttribute("rotations"))

    def _joints(self, query: Any, bones: Any, path: Any) -> FloatArray:
        """Where the joints of a mesh take points, `(j, 4, 4)` for row vectors; none if unknown.

        Joints that the skeleton does not have (reported) stay where they were bound.
        """
        transforms = bones.ComputeSkinningTransforms(self._time(bones))
        joints = np.array(transforms, dtype=np.float64).reshape(-1, 4, 4)
        names = query.GetJointOrder()
        if not names:
            return joints
        rows = {name: row for row, name in enumerate(bones.GetJointOrder())}
        chosen = [rows.get(name, len(joints)) for name in names]
        if not len(joints):
            return joints
        if max(chosen) == len(joints):
            message = "joints that a mesh names and its skeleton does not have do not move"
            self._report.add("usd-skinning", message, path)
        return np.concatenate((joints, np.eye(4)[None]))[chosen]

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
