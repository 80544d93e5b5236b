"""Request bodies: read within the limit, then made into models."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

from fastapi import Request
from pydantic import BaseModel, ValidationError
from pydantic_core import from_json

from dsl.suggest import did_you_mean
from server.problems import Problem
from server.settings import Settings

JSON, TEXT, NPZ = "application/json", "text/plain", "application/x-npz"

Model = TypeVar("Model", bound=BaseModel)


@dataclass(frozen=True, slots=True)
class Body:
    """A request's body: its media type without parameters, its bytes, and the query beside it."""

    media_type: str
    content: bytes
    query: dict[str, str]

    def parse(self, model: type[Model], text: bool = True) -> Model:
        """The model in the body: JSON or, with `text`, the scene program itself as plain text.

        Beside plain text, the model's other fields are the query's parameters; `params.count=12` is
        an entry of the field `params`. Raises the problem 415 for other media types, 422 for a body
        that does not fit the model.
        """
        if self.media_type == JSON:
            try:
                value = from_json(self.content, allow_inf_nan=False)
            except ValueError as error:
                raise Problem(422, "invalid-body", f"the body is not JSON: {error}") from None
            if not isinstance(value, dict):
                raise Problem(422, "invalid-body", "the body is JSON, but not an object")
            return validate(model, value)
        if self.media_type == TEXT and text:
            try:
                source = self.content.decode("utf-8-sig")
            except UnicodeDecodeError as error:
                raise Problem(422, "invalid-body", f"the program is not UTF-8: {error}") from None
            return validate(model, {**_nested(self.query), "source": source})
        raise Problem(
            415,
            "unsupported-media-type",
            f"the body is {self.media_type or 'of no stated type'}: add the header "
            f"`Content-Type: {TEXT if text else JSON}`, or what else /openapi.json names",
        )


def _nested(query: dict[str, str]) -> dict[str, object]:
    """The query with entries of `params` in one field."""
    params = {name[7:]: value for name, value in query.items() if name.startswith("params.")}
    fields = {name: value for name, value in query.items() if not name.startswith("params.")}
    return {**fields, **({"params": params} if params else {})}


def media_type(request: Request) -> str:
    """The media type of a request's body, without parameters."""
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


async def read_body(request: Request, settings: Settings) -> Body:
    """The body of a request, or the problem 413 as soon as it is too long."""
    kind = media_type(request)
    name = "max_body_bytes" if kind == NPZ else "max_text_bytes"
    limit: int = getattr(settings, name)
    too_large = Problem(413, "body-too-large", f"such a body may have {limit} bytes ({name})")
    declared = request.headers.get("content-length", "")
    if declared.isdecimal() and int(declared) > limit:
        raise too_large
    content = bytearray()
    async for chunk in request.stream():
        content += chunk
        if len(content) > limit:
            raise too_large
    return Body(kind, bytes(content), dict(request.query_params))


def validate(model: type[Model], values: Mapping[str, object]) -> Model:
    """The model with these values, or the problem 422 that names each fault."""
    # Unknown names are counted before pydantic sees them: it keeps an error for each.
    unknown = [name for name in values if name not in model.model_fields]
    if unknown:
        known = [*model.model_fields]
        help = did_you_mean(unknown[0], known) or f"there are {', '.join(known)}"
        raise Problem(422, "invalid-body", f"there is no field `{unknown[0]:.60}`; {help}")
    try:
        return model.model_validate(values)
    except ValidationError as error:
        faults = [
            {
                "field": ".".join(map(str, fault["loc"])),
                "message": fault["msg"].removeprefix("Value error, "),
            }
            for fault in error.errors(include_url=False, include_context=False)
        ]
        first = faults[0]
        detail = ": ".join(text for text in (first["field"], first["message"]) if text)
        raise Problem(422, "invalid-body", detail, {"faults": faults}) from None
