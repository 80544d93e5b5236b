"""Errors over HTTP: every one is an `application/problem+json` (RFC 9457)."""

from __future__ import annotations

from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.responses import JSONResponse, Response
from starlette.exceptions import HTTPException

from dsl.diagnostics import CompileError
from dsl.render_diagnostic import render_diagnostics, to_json

MEDIA_TYPE = "application/problem+json"


class Problem(Exception):
    """An answer that is not what was asked for.

    `kind` names the problem for programs, `detail` tells people what is wrong and how to mend
    it; `extra` are further members, `headers` further headers of the answer.
    """

    def __init__(
        self,
        status: int,
        kind: str,
        detail: str,
        extra: dict[str, Any] | None = None,
        headers: dict[str, str] | None = None,
    ) -> None:
        super().__init__(detail)
        self.status = status
        self.kind = kind
        self.detail = detail
        self.extra = extra or {}
        self.headers = headers

    def response(self) -> Response:
        """The problem as an answer."""
        body = {
            "type": f"urn:ovolo:problem:{self.kind}",
            "title": HTTPStatus(self.status).phrase,
            "status": self.status,
            "detail": self.detail,
            **self.extra,
        }
        return JSONResponse(body, self.status, self.headers, media_type=MEDIA_TYPE)


def install(app: FastAPI) -> None:
    """Answer every exception of an application with its problem."""
    app.add_exception_handler(Problem, _problem)
    app.add_exception_handler(CompileError, _compile_error)
    app.add_exception_handler(HTTPException, _http)
    app.add_exception_handler(Exception, _bug)


def _problem(request: Request, error: Exception) -> Response:
    assert isinstance(error, Problem)
    return error.response()


def _compile_error(request: Request, error: Exception) -> Response:
    """A faulty scene: its diagnostics as data and as text."""
    assert isinstance(error, CompileError)
    return Problem(
        422,
        "scene-faults",
        str(error),
        {
            "diagnostics": [to_json(diagnostic) for diagnostic in error.diagnostics],
            "rendered": render_diagnostics(error.diagnostics),
        },
    ).response()


def _http(request: Request, error: Exception) -> Response:
    """What the framework refuses by itself: an unknown path, another method."""
    assert isinstance(error, HTTPException)
    detail = f"{request.method} {request.url.path}: {error.detail}"
    headers = dict(error.headers) if error.headers else None
    return Problem(error.status_code, "http", detail, headers=headers).response()


def _bug(request: Request, error: Exception) -> Response:
    """A fault of ours: the log has the traceback, the client does not."""
    return Problem(500, "bug", "this is a fault of ovolo's own: please report it").response()
