"""`POST /v1/render`: a picture in the answer itself."""

from __future__ import annotations

from time import perf_counter

from fastapi import APIRouter, Request
from fastapi.responses import Response

from runtime.render import render as render_ir
from server.bodies import Body
from server.models import RenderRequest
from server.negotiation import choose
from server.openapi import operation
from server.problems import Problem
from server.programs import compile_program
from server.settings import Settings
from server.workshop import Ticket, Workshop

router = APIRouter(prefix="/v1", tags=["pictures"])

FORMATS = {"image/png": "png", "image/jpeg": "jpeg", "image/x-exr": "exr"}
_PICTURE = {"schema": {"type": "string", "format": "binary"}}


@router.post(
    "/render",
    summary="A picture of a program",
    openapi_extra=operation(RenderRequest, dict.fromkeys(FORMATS, _PICTURE)),
)
async def render(request: Request) -> Response:
    """PNG, JPEG, or OpenEXR with depth, normals and instance numbers, as `Accept` would have it.

    The headers `Ovolo-Rays` (rays traced), `Ovolo-Warnings` (their number) and
    `Server-Timing` (milliseconds) tell what it took.
    """
    media_type = choose(request.headers.get("accept"), tuple(FORMATS))
    format = FORMATS[media_type]
    settings: Settings = request.app.state.settings
    workshop: Workshop = request.app.state.workshop

    def work(body: Body, ticket: Ticket) -> Response:
        start = perf_counter()
        asked = body.parse(RenderRequest)
        ticket.shorten(asked.max_seconds)
        compilation = compile_program(asked, settings)
        compiled = perf_counter()
        ticket()
        try:
            film = render_ir(
                compilation.ir,
                width=asked.width,
                height=asked.height,
                samples=asked.samples,
                camera=asked.camera,
                integrator=asked.integrator,
                precision=asked.precision,
                seed=asked.seed,
                progress=ticket,
                max_pixels=settings.max_pixels,
                max_camera_rays=settings.max_camera_rays,
                root=compilation.reader.files.root,
                surfaces=format == "exr",
            )
        except ValueError as error:
            raise Problem(422, "invalid-settings", str(error)) from None
        rendered = perf_counter()
        content = film.encode(format)
        stages = {
            "compile": compiled - start,
            "render": rendered - compiled,
            "encode": perf_counter() - rendered,
        }
        headers = {
            "Ovolo-Rays": str(film.rays),
            "Ovolo-Warnings": str(len(compilation.warnings) + len(film.warnings)),
            "Server-Timing": ", ".join(f"{name};dur={s * 1e3:.1f}" for name, s in stages.items()),
        }
        return Response(content, headers=headers, media_type=media_type)

    return await workshop.run(request, work)
