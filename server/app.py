"""The application: settings in, an ASGI app out."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from fastapi import FastAPI

from runtime import _kernel
from server import openapi, problems
from server.routes import health, rays, render, scenes
from server.settings import Settings
from server.strangers import NoStrangers
from server.workshop import Workshop


def create_app(settings: Settings | None = None) -> FastAPI:
    """The service with these limits; every app has its own threads."""
    settings = settings or Settings()
    workshop = Workshop(settings)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        yield
        workshop.close()

    app = FastAPI(
        title="Ovolo",
        summary="Scene programs to pictures, hits and diagnostics.",
        version=_kernel.__version__,
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
    )
    app.state.settings = settings
    app.state.workshop = workshop
    for module in (health, scenes, render, rays):
        app.include_router(module.router)
    problems.install(app)
    app.add_middleware(NoStrangers, hosts=settings.hosts)
    app.openapi = openapi.describe(app)  # type: ignore[method-assign]  # FastAPI's own way
    return app
