"""Files: what a scene may read, and what it may not."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from dsl.files import FileFault, Files


@pytest.fixture
def root(tmp_path: Path) -> Path:
    inside = tmp_path / "scene"
    (inside / "parts").mkdir(parents=True)
    (tmp_path / "secret.ovo").write_text("let secret = 1")
    (inside / "top.ovo").write_text("let top = 1")
    (inside / "parts" / "brick.ovo").write_bytes(b"\xef\xbb\xbflet brick = 1")
    (inside / "link.ovo").symlink_to(tmp_path / "secret.ovo")
    (inside / "loop.ovo").symlink_to(inside / "loop.ovo")
    return inside


def test_names_start_from_the_folder_of_the_file(root: Path) -> None:
    files = Files(root)
    assert files.read_text("brick.ovo", "parts") == "let brick = 1"
    assert files.read_text("../top.ovo", "parts") == "let top = 1"
    assert files.resolve("parts/../top.ovo") == root / "top.ovo"


@pytest.mark.parametrize(
    ("path", "code"),
    [
        ("../secret.ovo", "file-outside"),
        ("parts/../../secret.ovo", "file-outside"),
        ("/etc/passwd", "file-outside"),
        ("link.ovo", "file-outside"),
        ("file:///etc/passwd", "file-outside"),
        ("https://example.org/a.obj", "file-outside"),
        ("C:\\secret.ovo", "file-outside"),
        ("top.ov", "file-missing"),
        ("", "file-missing"),
        ("a\0b", "file-missing"),
        ("parts", "file-unreadable"),
        ("loop.ovo", "file-unreadable"),
        ("x" * 5_000, "file-unreadable"),
    ],
)
def test_what_cannot_be_read(root: Path, path: str, code: str) -> None:
    with pytest.raises(FileFault) as raised:
        Files(root).read_bytes(path)
    assert raised.value.diagnostic(None).code == code


def test_without_a_root_every_file_can_be_read(root: Path) -> None:
    files = Files()
    assert files.read_text(str(root / "top.ovo")) == "let top = 1"
    assert files.read_text("link.ovo", str(root)) == "let secret = 1"
    with pytest.raises(FileFault):
        files.read_bytes("https://example.org/a.obj")


def test_large_files_and_other_encodings(root: Path) -> None:
    (root / "latin.ovo").write_text("// Größe", encoding="latin-1")
    with pytest.raises(FileFault, match="not UTF-8"):
        Files(root).read_text("latin.ovo")
    with pytest.raises(FileFault, match="more than 4"):
        Files(root, max_bytes=4).read_text("top.ovo")


def test_links_in_a_circle_are_told(root: Path) -> None:
    with pytest.raises(FileFault, match="symbolic links lead in a circle"):
        Files(root).read_bytes("loop.ovo")


class _Meanwhile(Files):
    """Files with something that happens between looking at a file and reading it."""

    def __init__(self, happens: Callable[[Path], object]) -> None:
        super().__init__(max_bytes=100)
        self.happens = happens

    def resolve(self, path: str, folder: str = "", source_bytes: int | None = None) -> Path:
        """The file, which is another one a moment later."""
        found = super().resolve(path, folder, source_bytes)
        self.happens(found)
        return found


def _become_a_pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


@pytest.mark.parametrize(
    ("happens", "code"),
    [
        (_become_a_pipe, "file-unreadable"),
        (Path.unlink, "file-unreadable"),
        (lambda path: path.write_bytes(b" " * 1000), "file-too-large"),
    ],
)
def test_a_file_that_changes_is_read_in_bounded_time(
    root: Path, happens: Callable[[Path], object], code: str
) -> None:
    with pytest.raises(FileFault) as raised:
        _Meanwhile(happens).read_bytes("top.ovo", str(root))
    assert raised.value.code == code


@pytest.mark.skipif(
    not Path("/proc/self/status").exists(), reason="needs a file that tells no size"
)
def test_a_file_that_grows_while_it_is_read(root: Path) -> None:
    with pytest.raises(FileFault, match="changes meanwhile"):
        Files().read_bytes("/proc/self/status")
