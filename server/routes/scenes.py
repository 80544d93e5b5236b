"""`POST /v1/check`, `/v1/format` and `/v1/compile`: programs without pictures."""

from __future__ import annotations

import json

from fastapi import APIRouter, Request
from fastapi.responses import Response

from compiler.ir_text import print_ir
from dsl.diagnostics import CompileError
from dsl.format import format_source
from dsl.render_diagnostic import render_diagnostics, to_json
from dsl.spans import Source
from server.bodies import JSON, TEXT, Body
from server.models import CheckAnswer, CompileAnswer, FormatAnswer, Program
from server.negotiation import choose
from server.openapi import operation, reference
from server.programs import compile_program
from server.workshop import Ticket, Workshop

router = APIRouter(prefix="/v1", tags=["scenes"])


@router.post(
    "/check",
    summary="What is wrong with a program",
    openapi_extra=operation(Program, {JSON: reference(CheckAnswer), TEXT: {}}),
)
async def check(request: Request) -> Response:
    """Diagnostics as JSON or as text; a faulty program is a fine question, so the status is 200."""
    media_type = choose(request.headers.get("accept"), (JSON, TEXT))
    workshop: Workshop = request.app.state.workshop

    def work(body: Body, ticket: Ticket) -> bytes:
        try:
            compilation = compile_program(body.parse(Program), request.app.state.settings)
            diagnostics = list(compilation.warnings)
        except CompileError as error:
            diagnostics = error.diagnostics
        if media_type == TEXT:
            return render_diagnostics(diagnostics).encode()
        ok = not any(diagnostic.severity == "error" for diagnostic in diagnostics)
        answer = {"ok": ok, "diagnostics": [to_json(diagnostic) for diagnostic in diagnostics]}
        return json.dumps(answer).encode()

    return Response(await workshop.run(request, work), media_type=media_type)


@router.post(
    "/format",
    summary="A program in its canonical form",
    openapi_extra=operation(Program, {TEXT: {}, JSON: reference(FormatAnswer)}),
)
async def format(request: Request) -> Response:
    """The same words and comments, laid out anew; 422 for a program with faults of syntax."""
    media_type = choose(request.headers.get("accept"), (TEXT, JSON))
    workshop: Workshop = request.app.state.workshop

    def work(body: Body, ticket: Ticket) -> bytes:
        program = body.parse(Program)
        formatted, faults = format_source(
            Source(program.name, program.source.removeprefix("\ufeff"))
        )
        if formatted is None:
            raise CompileError(faults)
        if media_type == TEXT:
            return formatted.encode()
        return json.dumps({"source": formatted}).encode()

    return Response(await workshop.run(request, work), media_type=media_type)


@router.post(
    "/compile",
    summary="What a program consists of",
    openapi_extra=operation(Program, {JSON: reference(CompileAnswer), TEXT: {}}),
)
async def compile(request: Request) -> Response:
    """The summary of the flat IR as JSON, or the IR in its canonical text form."""
    media_type = choose(request.headers.get("accept"), (JSON, TEXT))
    workshop: Workshop = request.app.state.workshop

    def work(body: Body, ticket: Ticket) -> bytes:
        compilation = compile_program(body.parse(Program), request.app.state.settings)
        if media_type == TEXT:
            return print_ir(compilation.ir).encode()
        return json.dumps(compilation.figures()).encode()

    return Response(await workshop.run(request, work), media_type=media_type)
