"""Random stages: nested transform stacks, instances of both kinds, every gprim, and meshes."""

from __future__ import annotations

import math
from random import Random
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom, Vt

GPRIMS = (
    "Sphere", "Cube", "Cylinder", "Cone", "Capsule", "Plane", "Cylinder_1", "Capsule_1", "Mesh",
    "Points", "BasisCurves",
)  # fmt: skip
TIMES = (0.0, 10.0)
Op = UsdGeom.XformOp


def random_stage(seed: int) -> str:
    """The text of a stage. Its samples are at `TIMES`."""
    return _Builder(Random(seed)).text()


class _Builder:
    def __init__(self, random: Random) -> None:
        self.random = random
        self.stage = Usd.Stage.CreateInMemory()
        self.classes: list[str] = []
        self.budget = 40

    def text(self) -> str:
        for number in range(self.random.randint(1, 2)):
            prim = self.stage.CreateClassPrim(f"/_class{number}")
            if self.coin():
                prim.SetTypeName("Xform")
            self._children(prim, 2)
            self.classes.append(str(prim.GetPath()))
        for name in "ab"[: self.random.randint(1, 2)]:
            self._prim(f"/{name}", 3)
        text = self.stage.GetRootLayer().ExportToString()
        assert isinstance(text, str)
        return text

    def _children(self, parent: Any, depth: int) -> None:
        for name in "xyzw"[: self.random.randint(2, 4)]:
            self._prim(f"{parent.GetPath()}/{name}", depth)

    def _prim(self, path: str, depth: int) -> None:
        kinds = ["gprim"]
        if depth > 0 and self.budget > 0:
            kinds += ["Xform", "Scope", "", "PointInstancer", "PointInstancer"]
            kinds += ["instance"] * 3 if self.classes else []
        self.budget -= 1
        kind = self.random.choice(kinds)
        if kind == "gprim":
            self._gprim(path)
        elif kind == "PointInstancer":
            self._instancer(path, depth)
        elif kind == "instance":
            prim = self.stage.DefinePrim(path, self.random.choice(["Xform", ""]))
            prim.GetInherits().AddInherit(self.random.choice(self.classes))
            prim.SetInstanceable(self.random.choice([True, True, False]))
            self._transform(prim)
            self._tokens(prim)
        else:
            prim = self.stage.DefinePrim(path, kind)
            self._transform(prim)
            self._tokens(prim)
            self._children(prim, depth - 1)

    def _tokens(self, prim: Any) -> None:
        imageable = UsdGeom.Imageable(prim)
        if not imageable:
            return
        if self.random.randint(0, 9) == 0:
            imageable.CreatePurposeAttr(self.random.choice(["default", "render", "proxy", "guide"]))
        if self.random.randint(0, 9) == 0:
            attribute = imageable.CreateVisibilityAttr()
            for time in self.random.choice([TIMES, (Usd.TimeCode.Default(),)]):
                attribute.Set(self.random.choice(["inherited", "invisible"]), time)

    def coin(self) -> bool:
        return self.random.random() < 0.5

    def _number(self, low: float, high: float) -> float:
        return self.random.randint(0, 64) / 64.0 * (high - low) + low

    def _vector(self, low: float, high: float) -> tuple[float, float, float]:
        return (self._number(low, high), self._number(low, high), self._number(low, high))

    def _scale(self) -> tuple[float, float, float]:
        x, y, z = self._vector(0.5, 1.5)
        signs = self.random.choice([(1, 1, 1), (1, 1, 1), (-1, 1, 1), (1, -1, -1)])
        return (x * signs[0], y * signs[1], z * signs[2])

    # Transforms

    def _transform(self, prim: Any) -> None:
        xformable = UsdGeom.Xformable(prim)
        if not xformable or self.random.randint(0, 3) == 0:
            return
        ops = []
        if self.random.randint(0, 3) == 0:
            pivot = xformable.AddTranslateOp(opSuffix="pivot")
            pivot.Set(self._vector(-1, 1))
            ops += [pivot, self._op(xformable, "inner")]
            ops.append(xformable.AddTranslateOp(opSuffix="pivot", isInverseOp=True))
        for number in range(self.random.randint(0, 3)):
            ops.append(self._op(xformable, f"op{number}"))
        self._op(xformable, "unlisted")
        if ops and self.random.randint(0, 9) == 0:
            ops.append(ops[0])
        xformable.SetXformOpOrder(ops, self.random.randint(0, 11) == 0)

    def _op(self, xformable: Any, suffix: str) -> Any:
        kind = self.random.choice([
            "translate", "scale", "rotateXYZ", "rotateZXY", "rotateYXZ", "rotateX", "rotateY",
            "orient", "transform", "translateY", "scaleZ",
        ])  # fmt: skip
        precision = Op.PrecisionDouble
        if kind not in ("transform",):
            precision = self.random.choice(
                [Op.PrecisionDouble, Op.PrecisionFloat, Op.PrecisionHalf]
            )  # fmt: skip
        kinds = {
            "translate": Op.TypeTranslate, "scale": Op.TypeScale, "rotateXYZ": Op.TypeRotateXYZ,
            "rotateZXY": Op.TypeRotateZXY, "rotateYXZ": Op.TypeRotateYXZ,
            "rotateX": Op.TypeRotateX, "rotateY": Op.TypeRotateY, "orient": Op.TypeOrient,
            "transform": Op.TypeTransform, "translateY": Op.TypeTranslateY,
            "scaleZ": Op.TypeScaleZ,
        }  # fmt: skip
        op = xformable.AddXformOp(kinds[kind], precision, suffix)
        sampled = kind not in ("orient", "scale", "scaleZ") and self.random.randint(0, 4) == 0
        for time in TIMES if sampled else (Usd.TimeCode.Default(),):
            op.Set(self._op_value(kind, op), time)
        return op

    def _op_value(self, kind: str, op: Any) -> Any:
        if kind == "translate":
            value: Any = self._vector(-2, 2)
        elif kind == "scale":
            value = self._scale()
        elif kind.startswith("rotate") and len(kind) > 7:
            value = self._vector(-180, 180)
        elif kind.startswith("rotate"):
            value = self._number(-720, 720)
        elif kind == "translateY":
            value = self._number(-2, 2)
        elif kind == "scaleZ":
            value = self._scale()[0]
        elif kind == "transform":
            rows = np.eye(4)
            rows[:3, :3] += [self._vector(-0.3, 0.3) for _ in range(3)]
            rows[3, :3] = self._vector(-2, 2)
            return Gf.Matrix4d(*rows.ravel().tolist())
        else:
            return self._quaternion(op.GetAttr().GetTypeName())
        attribute = op.GetAttr().GetTypeName().type.pythonClass
        return attribute(value) if attribute not in (None, float) else value

    def _quaternion(self, value_type: Any) -> Any:
        angle = math.radians(self._number(-180, 180))
        axis = Gf.Vec3d(*self._vector(-1, 1))
        axis = axis.GetNormalized() if axis.GetLength() > 0.1 else Gf.Vec3d(0, 0, 1)
        turned = Gf.Quatd(math.cos(angle / 2), axis * math.sin(angle / 2))
        quaternion = value_type.type.pythonClass
        return quaternion(turned)

    # Surfaces

    def _gprim(self, path: str) -> None:
        kind = self.random.choice(GPRIMS)
        prim = self.stage.DefinePrim(path, kind)
        self._transform(prim)
        self._tokens(prim)
        said = self.coin()

        def say(name: str, low: float, high: float) -> None:
            if said:
                prim.GetAttribute(name).Set(self._number(low, high))

        if kind == "Mesh":
            self._mesh(UsdGeom.Mesh(prim))
        elif kind == "BasisCurves":
            count = self.random.randint(2, 4)
            prim.GetAttribute("type").Set("linear")
            prim.GetAttribute("curveVertexCounts").Set([count])
            prim.GetAttribute("points").Set([self._vector(-1, 1) for _ in range(count)])
            prim.GetAttribute("widths").Set([self._number(0.25, 0.75)])
            UsdGeom.Curves(prim).SetWidthsInterpolation("constant")
        elif kind == "Points":
            count = self.random.randint(1, 3)
            prim.GetAttribute("points").Set([self._vector(-1, 1) for _ in range(count)])
            prim.GetAttribute("widths").Set([self._number(0.25, 1) for _ in range(count)])
        else:
            for name in (
                "radius",
                "radiusTop",
                "radiusBottom",
                "height",
                "size",
                "width",
                "length",
            ):
                if prim.GetAttribute(name):
                    say(name, 0.25, 1.5)
            if prim.GetAttribute("axis") and self.coin():
                prim.GetAttribute("axis").Set(self.random.choice("XYZ"))

    def _mesh(self, mesh: Any) -> None:
        """A prism over a star-shaped polygon, any face of which may be missing or broken."""
        sides = self.random.randint(3, 7)
        turns = 2.0 * np.pi * np.arange(sides) / sides
        radii = np.array([self._number(0.3, 1.2) for _ in range(sides)])
        low = np.stack((radii * np.cos(turns), radii * np.sin(turns), 0.0 * turns - 0.4), axis=1)
        # Faces stay plane in single precision.
        low = np.round(low * 1024.0) / 1024.0
        points = np.concatenate((low, low + np.array((0.1875, 0.125, 0.875))))
        faces = [list(range(sides))[::-1], list(range(sides, 2 * sides))]
        faces += [[i, (i + 1) % sides, (i + 1) % sides + sides, i + sides] for i in range(sides)]
        indices = [i for face in faces for i in face]
        counts = [len(face) for face in faces]
        fault = self.random.choice(["", "", "", "index", "short", "nan", "end"])
        if fault == "index":
            indices[self.random.randint(0, len(indices) - 1)] = self.random.choice(
                [-1, 2 * sides, 2**31 - 1]
            )
        elif fault == "short":
            counts, indices = [2, *counts], [0, 1, *indices]
        elif fault == "nan":
            points[self.random.randint(0, len(points) - 1), 1] = math.nan
        elif fault == "end":
            counts[-1] += 1
        mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(points.astype(np.float32)))
        mesh.CreateFaceVertexCountsAttr(counts)
        mesh.CreateFaceVertexIndicesAttr(indices)
        scheme = self.random.choice([None, "none", "catmullClark"])
        if scheme:
            mesh.CreateSubdivisionSchemeAttr(scheme)
        mesh.CreateOrientationAttr(self.random.choice(["rightHanded", "leftHanded"]))
        if self.random.randint(0, 3) == 0:
            mesh.CreateHoleIndicesAttr([self.random.randint(0, len(faces) - 1)])

    # Point instancers

    def _instancer(self, path: str, depth: int) -> None:
        instancer = UsdGeom.PointInstancer.Define(self.stage, path)
        prim = instancer.GetPrim()
        self._transform(prim)
        self._tokens(prim)
        targets = []
        for number in range(self.random.randint(1, 2)):
            place = self.random.choice(["below", "below", "class", "elsewhere"])
            if place == "class" and self.classes:
                chosen = self.random.choice(self.classes)
                targets += [chosen] if chosen not in targets else []
                continue
            parent = path
            if place == "elsewhere":
                parent = f"{path}_kept"
                self.stage.OverridePrim(parent)
            target = f"{parent}/p{number}"
            self._prim(target, depth - 1)
            targets.append(target)
        instancer.GetPrototypesRel().SetTargets([Sdf.Path(target) for target in targets])
        count = self.random.randint(1, 4)
        instancer.CreateProtoIndicesAttr(
            [self.random.randint(0, len(targets) - 1) for _ in range(count)]
        )
        attribute = instancer.CreatePositionsAttr()
        for time in self.random.choice([TIMES, (Usd.TimeCode.Default(),)]):
            attribute.Set([self._vector(-3, 3) for _ in range(count)], time)
        turn = self.random.choice(["", "orientations", "orientationsf"])
        if turn:
            attribute = prim.GetAttribute(turn)
            value_type = attribute.GetTypeName().scalarType
            attribute.Set([self._quaternion(value_type) for _ in range(count)])
        if self.coin():
            instancer.CreateScalesAttr([self._scale() for _ in range(count)])
        ids = list(range(count))
        if self.coin():
            ids = [7 * i + 3 for i in range(count)]
            instancer.CreateIdsAttr(ids)
        if self.random.randint(0, 3) == 0:
            instancer.CreateInvisibleIdsAttr([self.random.choice([*ids, 1])])
        if self.random.randint(0, 3) == 0:
            instancer.DeactivateIds([self.random.choice([*ids, 1])])
