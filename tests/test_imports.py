"""The rooms import one way, and nothing heavy is loaded before it is needed."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROOMS = ("dsl", "compiler", "runtime", "server", "ovolo")
HEAVY = (
    "pxr",
    "OpenImageIO",
    "trimesh",
    "fastapi",
    "uvicorn",
    "rich",
    "matplotlib",
    "pygls",
    "lsprotocol",
    "watchfiles",
)


def imported(path: Path) -> Iterator[tuple[int, str]]:
    """Line and full name of every module that a file imports, wherever in the file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: imports are absolute"
            assert node.module is not None
            yield from ((node.lineno, f"{node.module}.{alias.name}") for alias in node.names)


def is_allowed(path: Path, module: str) -> bool:
    """Whether a file of ours may import a module of ours."""
    room, other = path.relative_to(ROOT).parts[0], module.partition(".")[0]
    if other not in ROOMS or other == room:
        return True
    if room == "runtime":
        allowed = {
            "compiler.ir",
            "dsl.codes.diagnostic",
            "dsl.diagnostics.Diagnostic",
            "dsl.observation.stage",
            "dsl.scene.Integrator",
            "dsl.scene.Precision",
            "dsl.whole_files.replacing",
        }
        if path.is_relative_to(ROOT / "runtime" / "reference"):
            allowed = {"dsl.scene"}
        return bool({module, module.rpartition(".")[0]} & allowed)
    return ROOMS.index(other) < ROOMS.index(room)


@pytest.mark.parametrize("room", ROOMS)
def test_rooms_import_one_way(room: str) -> None:
    wrong = [
        f"{path.relative_to(ROOT)}:{line} imports {module}"
        for path in sorted((ROOT / room).rglob("*.py"))
        for line, module in imported(path)
        if not is_allowed(path, module)
    ]
    assert not wrong


def loaded_by(statement: str) -> set[str]:
    """The modules that a fresh interpreter has loaded after a statement."""
    script = f"import sys\n{statement}\nprint(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return set(done.stdout.split())


def test_importing_ovolo_loads_almost_nothing() -> None:
    loaded = loaded_by("import ovolo")
    assert not loaded & {"numpy", "dsl.scene", "runtime._kernel", *HEAVY}


def test_checking_a_scene_loads_neither_kernel_nor_what_pictures_need(tmp_path: Path) -> None:
    scene = tmp_path / "small.ovo"
    scene.write_text("sphere()\n")
    loaded = loaded_by(
        f"from ovolo.__main__ import main\nassert main(['check', {str(scene)!r}]) == 0"
    )
    assert not loaded & {"runtime._kernel", "server.app", *HEAVY}


def test_rendering_a_program_loads_neither_usd_nor_the_service(tmp_path: Path) -> None:
    scene, picture = tmp_path / "small.ovo", tmp_path / "small.png"
    scene.write_text("sphere()\n")
    loaded = loaded_by(
        "from ovolo.__main__ import main\n"
        f"assert main(['render', {str(scene)!r}, '-o', {str(picture)!r}, '--width', '8', "
        "'--height', '8', '--quiet']) == 0"
    )
    assert not loaded & set(HEAVY)
