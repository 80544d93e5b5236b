"""Programs that come over HTTP, and the files that they may read."""

from __future__ import annotations

from pathlib import Path

from compiler.compilation import Compilation, compile_text
from compiler.usd.options import Isolation
from dsl.files import FileFault, Files
from server.models import Program
from server.settings import Settings


class NoFiles(Files):
    """Gives no file, whatever its name: there is no folder for assets."""

    def resolve(self, path: str, folder: str = "", max_bytes: int | None = None) -> Path:
        """Raise FileFault."""
        raise FileFault(
            "file-outside",
            f"`{path}` cannot be read: scenes of this service read no files",
            "write it into the scene, or start the service with a folder for assets",
        )


def compile_program(program: Program, settings: Settings) -> Compilation:
    """Compile a program, confined to the folder for assets. Raises CompileError."""
    files = Files(settings.asset_root) if settings.asset_root is not None else NoFiles()
    isolation = Isolation(settings.max_seconds, settings.max_import_bytes)
    return compile_text(
        program.source,
        program.name,
        files,
        program.time,
        params=program.params,
        isolation=isolation,
    )
