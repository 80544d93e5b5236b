"""What requests say and what answers hold, as OpenAPI describes them."""

from __future__ import annotations

from typing import Annotated, Literal, TypeVar

import numpy as np
from annotated_types import MaxLen
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, PlainValidator

from dsl.scene import Integrator, Precision

Vector = tuple[float, float, float]

_MOST_PARAMS = 1000
_MOST_COMPONENTS = 16


def _numbers(value: object) -> NDArray[np.float64]:
    """Nested lists as an array.

    NumPy ends at the first fault, where pydantic keeps one for every number that is none:
    gigabytes, for a hostile body of some megabytes.
    """
    try:
        array = np.asarray(value, np.float64)
    except (TypeError, OverflowError) as error:
        raise ValueError(str(error)) from None
    if np.isnan(array).any():
        raise ValueError("null is not a number")
    return array


def _few(params: object) -> object:
    if isinstance(params, dict) and len(params) > _MOST_PARAMS:
        raise ValueError(f"there are more than {_MOST_PARAMS}")
    return params


Form = TypeVar("Form")
Numbers = Annotated[Form, PlainValidator(_numbers)]
"""An array, described as that form of JSON."""


class Program(BaseModel):
    """A scene program."""

    model_config = ConfigDict(extra="forbid")

    source: str = Field(description="The text of the program.")
    name: str = Field(
        "scene.ovo",
        min_length=1,
        max_length=1000,
        description="What diagnostics call it; files are found relative to it.",
    )
    time: float | None = Field(
        None, allow_inf_nan=False, description="The program's `time`, 0 if not said."
    )
    params: Annotated[
        dict[str, float | bool | str | Annotated[list[float], MaxLen(_MOST_COMPONENTS)]],
        BeforeValidator(_few),
    ] = Field(
        {},
        description="Values for the program's parameters; an angle is text with its unit, and so "
        "may be any literal of the language. In a query: `params.count=12`.",
    )


class RenderRequest(Program):
    """A scene and the picture wanted of it; what is not said comes from the scene's settings."""

    width: int | None = Field(None, ge=1, description="Pixels.")
    height: int | None = Field(None, ge=1, description="Pixels.")
    samples: int | None = Field(None, ge=1, description="Camera rays per pixel.")
    camera: int | str | None = Field(None, description="Number or name of a camera of the scene.")
    integrator: Integrator | None = Field(None, description="What a pixel shows.")
    precision: Precision | None = Field(None, description="Scalar of the intersectors.")
    seed: int = Field(0, ge=0, lt=2**63, description="Of the sampling.")
    max_seconds: float | None = Field(
        None, gt=0, description="Longest wait; the service has its own limit too."
    )


class RaysProgram(Program):
    """A scene to trace rays against."""

    precision: Precision = Field("float64", description="Scalar of the intersectors.")


class RaysRequest(RaysProgram):
    """A scene and a batch of rays. Directions are not normalised: t is in their units."""

    origins: Numbers[Vector | list[Vector]] = Field(
        description="World space; one for all rays, or each."
    )
    directions: Numbers[Vector | list[Vector]] = Field(
        description="World space; one for all, or each."
    )
    t_min: Numbers[float | list[float]] = Field(0.0, description="One for all rays, or each.")
    t_max: Numbers[float | list[float]] | None = Field(None, description="The same; null: no end.")


class RaysAnswer(BaseModel):
    """The closest hits, entry i for ray i; null, and -1 for numbers, where nothing was hit."""

    t: list[float | None]
    position: list[Vector | None] = Field(description="World space.")
    normal: list[Vector | None] = Field(description="World space, unit, geometric, outward.")
    instance: list[int] = Field(description="In order of emission.")
    prototype: list[int]
    material: list[int]


class SpanPlace(BaseModel):
    """A range of a source text."""

    file: str
    start: int = Field(description="UTF-8 bytes before it.")
    end: int
    line: int = Field(description="From 1.")
    column: int = Field(description="From 1, in grapheme clusters (UAX 29).")
    end_line: int
    end_column: int
    text: str = Field(description="A few words about the place.")


class PrimPlace(BaseModel):
    """A prim of a USD stage."""

    stage: str
    prim: str
    text: str = Field(description="A few words about the place.")


class Diagnostic(BaseModel):
    """One fault or warning."""

    version: int = Field(description="Of this form.")
    code: str = Field(description="`phase-what`, for programs.")
    severity: Literal["error", "warning"]
    message: str
    primary: SpanPlace | PrimPlace | None
    secondary: list[SpanPlace | PrimPlace]
    help: str | None = Field(description="How to mend it.")


class CheckAnswer(BaseModel):
    """What is wrong with a scene."""

    ok: bool = Field(description="Whether the scene has no errors.")
    diagnostics: list[Diagnostic]


class FormatAnswer(BaseModel):
    """A program in its canonical form."""

    source: str


class Param(BaseModel):
    """A parameter of a program."""

    name: str
    value: float | bool | str | tuple[float, ...]
    default: float | bool | str | tuple[float, ...]
    low: float | str | None = Field(description="The least value; an angle is text with its unit.")
    high: float | str | None = Field(description="The greatest.")
    choices: list[float | bool | str | tuple[float, ...]] = Field(description="If not empty.")
    doc: str = Field(description="The text of the `///` lines above it.")


class CompileAnswer(BaseModel):
    """What a scene consists of."""

    leaves: int = Field(description="Instances, every group expanded.")
    instances: int = Field(description="Rows of the instance table.")
    groups: int
    prototypes: dict[str, int] = Field(description="How many of each shape.")
    mesh_points: int
    mesh_triangles: int
    materials: int
    lights: dict[str, int]
    skies: list[str]
    cameras: int
    bytes: int
    instance_bytes: float = Field(description="All memory but that of prototypes, per row.")
    bounds: tuple[Vector, Vector] | None = Field(description="World space; infinite shapes apart.")
    params: list[Param]
    pruned: dict[str, int] = Field(description="What the scene has and its IR does without.")
    hash: str = Field(description="SHA-256 of what the picture depends on.")


class Health(BaseModel):
    """That the service is there."""

    status: Literal["ok"] = "ok"
    version: str


class Problem(BaseModel):
    """An error (RFC 9457)."""

    type: str = Field(description="`urn:ovolo:problem:…`")
    title: str
    status: int
    detail: str = Field(description="What is wrong and how to mend it.")
    diagnostics: list[Diagnostic] | None = Field(
        None, description="Of a faulty scene: every fault, with its place."
    )
    rendered: str | None = Field(None, description="Of a faulty scene: the same, as text.")
