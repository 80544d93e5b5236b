"""Ovolo: scenes to pictures, with known accuracy.

    scene = ovolo.compile_file("igloo.ovo")        # or a USD stage
    scene.render(width=640, height=480).save("igloo.png")
    hits = scene.tracer().trace(origins, directions)

Importing this package is light: what a name needs is loaded when the name is first used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ovolo.shadowing import require_own_packages

require_own_packages()

if TYPE_CHECKING:
    from dsl.diagnostics import CompileError, Diagnostic
    from ovolo.scene import Scene, compile, compile_file
    from runtime.film import Film
    from runtime.tracer import Hits, Tracer

__version__ = "0.1.0"

__all__ = [
    "CompileError",
    "Diagnostic",
    "Film",
    "Hits",
    "Scene",
    "Tracer",
    "__version__",
    "compile",
    "compile_file",
]

_HOMES = {
    "CompileError": "dsl.diagnostics",
    "Diagnostic": "dsl.diagnostics",
    "Film": "runtime.film",
    "Hits": "runtime.tracer",
    "Scene": "ovolo.scene",
    "Tracer": "runtime.tracer",
    "compile": "ovolo.scene",
    "compile_file": "ovolo.scene",
}


def __getattr__(name: str) -> object:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module `ovolo` has no attribute {name!r}")
    from importlib import import_module

    value: object = getattr(import_module(home), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
