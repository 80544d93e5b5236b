"""What a stage's RenderSettings and their first RenderProduct ask of the picture's frame.

What a product says comes before what its settings say. The camera's window is made to fit the
picture by `aspectRatioConformPolicy`, and `dataWindowNDC` is the part of it that is taken. Pixels
are square: where a stage says otherwise, the picture gets more or fewer columns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pxr import UsdRender

from compiler.usd.clock import Clock
from compiler.usd.report import Report
from dsl.scene import Camera

_POLICIES = ("expandAperture", "cropAperture", "adjustApertureWidth", "adjustApertureHeight")
_WHOLE = (0.0, 0.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Framing:
    """The frame of a picture.

    `camera` is the path of the camera that takes it; `resolution` of the whole window in square
    pixels, columns and rows. `window` is the part that is taken: left, bottom, right, top.
    `product` is the name of the picture's file.
    """

    camera: str | None
    resolution: tuple[int, int] | None
    policy: str = "expandAperture"
    window: tuple[float, float, float, float] = _WHOLE
    product: str | None = None

    @property
    def size(self) -> tuple[int, int] | None:
        """Columns and rows of what is taken."""
        if self.resolution is None:
            return None
        left, bottom, right, top = self.window
        width, height = self.resolution
        return max(round(width * (right - left)), 1), max(round(height * (top - bottom)), 1)

    def framed(self, camera: Camera) -> Camera:
        """The camera with the window that the picture shows."""
        unchanged = self.policy == "expandAperture" and self.window == _WHOLE
        if unchanged or self.resolution is None or camera.aspect is None:
            return camera
        height, width = camera.height, camera.height * camera.aspect
        offsets = camera.shift[0] * width, camera.shift[1] * height
        aspect = self.resolution[0] / self.resolution[1]
        by_width = self.policy == "adjustApertureWidth"
        if self.policy in ("expandAperture", "cropAperture"):
            by_width = (aspect > camera.aspect) == (self.policy == "expandAperture")
        if by_width:
            width = height * aspect
        else:
            height = width / aspect
        left, bottom, right, top = self.window
        x = offsets[0] + width * ((left + right) / 2.0 - 0.5)
        y = offsets[1] + height * ((bottom + top) / 2.0 - 0.5)
        width, height = width * (right - left), height * (top - bottom)
        return replace(camera, height=height, aspect=width / height, shift=(x / width, y / height))


def read_framing(prim: Any, clock: Clock, report: Report) -> Framing:
    """The framing that a RenderSettings prim asks for; what cannot be is reported and not used."""
    said = [*_product(prim, report), prim]

    def attribute(name: str) -> Any:
        authored = (p.GetAttribute(name) for p in said if p.GetAttribute(name).HasAuthoredValue())
        return next(authored, None)

    cameras = (UsdRender.SettingsBase(p).GetCameraRel().GetForwardedTargets() for p in said)
    camera = next((str(targets[0]) for targets in cameras if targets), None)
    resolution = clock.vector(attribute("resolution"), 2, report)
    size = None
    if resolution is not None and np.isfinite(resolution).all():
        size = int(resolution[0]), int(resolution[1])
    pixel = clock.number(attribute("pixelAspectRatio"), 0.0)
    if size is not None and pixel > 0.0:
        columns = round(min(size[0] * pixel, 1e9))
        if columns != size[0]:
            message = f"pixels are square: the picture is {columns} of them across, not {size[0]}"
            report.add("usd-attribute", message, prim.GetPath())
        size = (columns, size[1])
    policy = clock.token(attribute("aspectRatioConformPolicy")) or "expandAperture"
    if policy not in _POLICIES:
        message = f"`aspectRatioConformPolicy = {policy}` is not used: windows are expanded"
        report.add("usd-attribute", message, prim.GetPath())
        policy = "expandAperture"
    window = _window(clock.vector(attribute("dataWindowNDC"), 4, report), prim, report)
    names = (clock.token(product.GetAttribute("productName")) for product in said[:-1])
    return Framing(camera, size, policy, window, next(names, "") or None)


def _product(prim: Any, report: Report) -> list[Any]:
    """The product that the picture is, at most one; others are reported."""
    targets = UsdRender.Settings(prim).GetProductsRel().GetForwardedTargets()
    products = [prim.GetStage().GetPrimAtPath(path) for path in targets]
    pictures = []
    for path, product in zip(targets, products, strict=True):
        schema = UsdRender.Product(product) if product else None
        if not schema:
            report.add("usd-attribute", "a render product that is not there is not used", path)
        elif schema.GetProductTypeAttr().Get() != "raster":
            report.add("usd-attribute", "render products that are no pictures are not used", path)
        else:
            pictures.append(product)
    for product in pictures[1:]:
        message = "of several render products, the first is the picture"
        report.add("usd-attribute", message, product.GetPath())
    return pictures[:1]


def _window(
    value: tuple[float, ...] | None, prim: Any, report: Report
) -> tuple[float, float, float, float]:
    if value is None:
        return _WHOLE
    left, bottom, right, top = value
    if np.isfinite(value).all() and left < right and bottom < top:
        return left, bottom, right, top
    report.add("usd-attribute", "a `dataWindowNDC` without extent is not used", prim.GetPath())
    return _WHOLE
