"""A user's own `server.py` must not be taken for ours."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent


def import_ovolo(folder: Path, before: str = "") -> subprocess.CompletedProcess[str]:
    """Import ovolo where `folder` comes first on the path, as a script's own folder does."""
    script = f"import sys; sys.path[:0] = [{str(folder)!r}, {str(ROOT)!r}]; {before}import ovolo"
    return subprocess.run([sys.executable, "-I", "-c", script], capture_output=True, text=True)


@pytest.mark.parametrize("package", ["dsl", "compiler", "runtime", "server"])
@pytest.mark.parametrize("kind", ["file", "package", "folder"])
def test_a_package_from_elsewhere_is_named(tmp_path: Path, package: str, kind: str) -> None:
    if kind == "file":
        culprit = tmp_path / f"{package}.py"
    else:
        (tmp_path / package).mkdir()
        culprit = tmp_path / package / "__init__.py"
    culprit.write_text("raise RuntimeError('not to be run')\n")
    if kind == "folder":  # without __init__.py Python takes it only where no package follows
        culprit.unlink()
        assert import_ovolo(tmp_path).returncode == 0
        return
    done = import_ovolo(tmp_path)
    assert done.returncode == 1
    message = done.stderr.strip().splitlines()[-1]
    assert message.startswith(f"ImportError: ovolo needs its own package `{package}`")
    assert str(culprit) in message
    assert "rename that file or folder" in message


def test_a_module_that_is_already_loaded_is_named(tmp_path: Path) -> None:
    (tmp_path / "server.py").write_text("")
    before = f"import server; sys.path.remove({str(tmp_path)!r}); "
    assert str(tmp_path / "server.py") in import_ovolo(tmp_path, before).stderr


def test_a_module_without_a_file_is_named(tmp_path: Path) -> None:
    before = "import types; sys.modules['server'] = types.ModuleType('server'); "
    message = import_ovolo(tmp_path, before).stderr.strip().splitlines()[-1]
    assert "`server`" in message
    assert "sys.modules" in message


def test_our_own_packages_are_found(tmp_path: Path) -> None:
    done = import_ovolo(tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
