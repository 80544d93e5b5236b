"""`POST /v1/rays`: the tracer over HTTP."""

from __future__ import annotations

import json

import numpy as np
from fastapi import APIRouter, Request
from fastapi.responses import Response
from numpy.typing import ArrayLike

from runtime.tracer import Hits, Tracer
from server.bodies import JSON, NPZ, Body, media_type, validate
from server.models import RaysAnswer, RaysProgram, RaysRequest
from server.negotiation import choose
from server.npz import read_npz, write_npz
from server.openapi import operation, reference
from server.problems import Problem
from server.programs import compile_program
from server.settings import Settings
from server.workshop import Ticket, Workshop

router = APIRouter(prefix="/v1", tags=["rays"])

_RAYS = ("origins", "directions", "t_min", "t_max")
_TEXTS = ("source", "name", "precision")
_ARCHIVE = {
    "schema": {
        "type": "string",
        "format": "binary",
        "description": f"An .npz of {', '.join(_TEXTS + _RAYS)}, as in RaysRequest.",
    }
}
_HITS = {"schema": {"type": "string", "format": "binary", "description": "An .npz of the hits."}}


@router.post(
    "/rays",
    summary="What rays hit",
    openapi_extra=operation(
        RaysRequest, {JSON: reference(RaysAnswer), NPZ: _HITS}, {NPZ: _ARCHIVE}, text=False
    ),
)
async def rays(request: Request) -> Response:
    """The closest hits of a batch of rays, as JSON or as NumPy arrays."""
    offered = (NPZ, JSON) if media_type(request) == NPZ else (JSON, NPZ)
    chosen = choose(request.headers.get("accept"), offered)
    settings: Settings = request.app.state.settings
    workshop: Workshop = request.app.state.workshop

    def work(body: Body, ticket: Ticket) -> bytes:
        program, batch = _question(body, settings)
        count = max(np.size(batch[name]) for name in _RAYS[:2]) // 3
        if count > settings.max_rays:
            raise Problem(413, "too-many-rays", f"{count} rays are more than {settings.max_rays}")
        compilation = compile_program(program, settings)
        ticket()
        tracer = Tracer(compilation.ir, program.precision)
        ticket()
        try:
            hits = tracer.trace(
                batch["origins"],
                batch["directions"],
                batch.get("t_min", 0.0),
                batch.get("t_max", np.inf),
                copy=False,
            )
        except ValueError as error:
            raise Problem(422, "invalid-rays", str(error)) from None
        return _archive(hits) if chosen == NPZ else _json(hits)

    return Response(await workshop.run(request, work), media_type=chosen)


def _question(body: Body, settings: Settings) -> tuple[RaysProgram, dict[str, ArrayLike]]:
    """The program and the rays of a body."""
    if body.media_type == NPZ:
        arrays = read_npz(body.content, settings.max_body_bytes)
        texts = {name: str(array) for name, array in arrays.items() if name not in _RAYS}
        program = validate(RaysProgram, texts)
        batch: dict[str, ArrayLike] = {name: arrays[name] for name in _RAYS if name in arrays}
        for name in _RAYS[:2]:
            if name not in batch:
                raise Problem(422, "invalid-body", f"the archive has no array `{name}`")
        return program, batch
    asked = body.parse(RaysRequest, text=False)
    return asked, {
        "origins": asked.origins,
        "directions": asked.directions,
        "t_min": asked.t_min,
        "t_max": np.inf if asked.t_max is None else asked.t_max,
    }


def _archive(hits: Hits) -> bytes:
    return write_npz({name: getattr(hits, name) for name in RaysAnswer.model_fields})


def _json(hits: Hits) -> bytes:
    """JSON knows neither infinity nor NaN: misses are null."""
    answer = {name: getattr(hits, name).tolist() for name in RaysAnswer.model_fields}
    for row in np.flatnonzero(~hits.hit):
        answer["t"][row] = answer["position"][row] = answer["normal"][row] = None
    return json.dumps(answer, allow_nan=False).encode()
