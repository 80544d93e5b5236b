"""`GET /healthz`."""

from __future__ import annotations

from fastapi import APIRouter

from runtime import _kernel
from server.models import Health

router = APIRouter(tags=["service"])


@router.get("/healthz", summary="Whether the service is there")
async def health() -> Health:
    """Answer at once, whatever else is going on."""
    return Health(version=_kernel.__version__)
