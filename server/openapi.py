"""The description of the service, OpenAPI 3.1.

Bodies come in several media types and are read by hand (`server.bodies`), which FastAPI cannot
see; here are their descriptions.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from server import models, problems
from server.bodies import JSON, TEXT

_MODELS: tuple[type[BaseModel], ...] = (
    models.Program,
    models.RenderRequest,
    models.RaysRequest,
    models.RaysAnswer,
    models.CheckAnswer,
    models.FormatAnswer,
    models.CompileAnswer,
    models.Problem,
)

_PROBLEMS = {
    "403": "A web page of another service, or another host, is not answered.",
    "406": "None of the media types in `Accept` is offered.",
    "408": "The body has not come in time.",
    "413": "The body is too large.",
    "415": "The body is of an unknown media type.",
    "422": "The scene has faults, or the request does not fit: see the diagnostics.",
    "503": "Too many requests, or not ready in time.",
}


def reference(model: type[BaseModel]) -> dict[str, Any]:
    """The schema of a model, by name."""
    return {"schema": {"$ref": f"#/components/schemas/{model.__name__}"}}


def operation(
    body: type[BaseModel],
    answers: dict[str, dict[str, Any]],
    further_bodies: dict[str, dict[str, Any]] | None = None,
    text: bool = True,
) -> dict[str, Any]:
    """What FastAPI adds to an operation: bodies and answers, by media type.

    With `text`, a program may also come as it is, the model's other fields being the query's.
    """
    problem = {problems.MEDIA_TYPE: reference(models.Problem)}
    bodies = {JSON: reference(body), **(further_bodies or {})}
    if text:
        bodies[TEXT] = {"schema": {"type": "string", "description": "The program itself."}}
    return {
        "parameters": _query(body) if text else [],
        "requestBody": {"required": True, "content": bodies},
        "responses": {
            "200": {"description": "Done.", "content": answers},
            **{
                status: {"description": description, "content": problem}
                for status, description in _PROBLEMS.items()
            },
        },
    }


def _query(body: type[BaseModel]) -> list[dict[str, Any]]:
    """The query's parameters beside a plain-text body: all fields but the text."""
    return [
        {"name": name, "in": "query", "schema": schema}
        for name, schema in body.model_json_schema()["properties"].items()
        if name != "source"
    ]


def describe(app: FastAPI) -> Callable[[], dict[str, Any]]:
    """The function that FastAPI calls for the description: made once, then kept."""

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            schema = get_openapi(
                title=app.title, version=app.version, summary=app.summary, routes=app.routes
            )
            _, definitions = models_json_schema(
                [(model, "serialization") for model in _MODELS],
                ref_template="#/components/schemas/{model}",
            )
            components = schema.setdefault("components", {}).setdefault("schemas", {})
            components.update(definitions["$defs"])
            app.openapi_schema = schema
        return app.openapi_schema

    return openapi
