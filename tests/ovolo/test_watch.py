"""`ovolo watch` as a process: what it does when files change."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from dsl.files import Files
from dsl.observation import observe, stage
from ovolo.__main__ import main

ROOT = Path(__file__).parent.parent.parent
BALL = 'use "parts/size.ovo" as size\nsphere(radius: size.of_ball)\n'
QUAD = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def save(path: Path, text: str) -> None:
    """Put the file there in one step, as most editors do: half a file is never seen."""
    new = path.parent / "new"
    new.write_text(text)
    new.replace(path)


class Watcher:
    """A running `ovolo watch`; `round` is what it says until it waits."""

    def __init__(self, folder: Path) -> None:
        small = ["--width", "8", "--height", "8", "--samples", "1"]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "ovolo", "watch", "ball.ovo", *small],
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(ROOT)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    def round(self) -> str:
        said = ""
        assert self.process.stderr is not None
        for line in self.process.stderr:
            said += line
            if "waiting for a change" in line:
                return said
        raise AssertionError(f"it ended: {said}")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "size.ovo").write_text("let of_ball = 1\n")
    (tmp_path / "ball.ovo").write_text(BALL)
    return tmp_path


@pytest.fixture
def watcher(folder: Path) -> Iterator[Watcher]:
    found = Watcher(folder)
    yield found
    found.process.kill()
    found.process.wait()
    assert found.process.stderr is not None
    found.process.stderr.close()


@pytest.mark.timeout(120)
def test_every_change_makes_a_picture_and_faults_do_not_end_it(
    folder: Path, watcher: Watcher
) -> None:
    said = watcher.round()
    for name in ("parse", "evaluate", "flatten", "build", "render", "write"):
        assert f"{name} 0." in said
    picture = folder / "ball.png"
    picture.unlink()
    # A fault is told, and so is its end.
    save(folder / "ball.ovo", "spher()\n")
    assert "error[name-unknown]" in watcher.round()
    assert not picture.exists()
    save(folder / "ball.ovo", BALL + 'mesh("parts/quad.obj")\n')
    assert "error[file-missing]" in watcher.round()
    # A file that was missing is there now; a used file changes; a mesh does.
    save(folder / "parts" / "quad.obj", QUAD)
    assert "error" not in watcher.round()
    assert picture.exists()
    save(folder / "parts" / "size.ovo", "let of_ball = -1\n")
    assert "error[value-out-of-range]" in watcher.round()
    save(folder / "parts" / "size.ovo", "let of_ball = 2\n")
    assert "error" not in watcher.round()
    save(folder / "parts" / "quad.obj", "nothing\n")
    assert "error[mesh-" in watcher.round()
    (folder / "ball.ovo").unlink()
    assert "error[file-missing]" in watcher.round()
    watcher.process.send_signal(signal.SIGINT)
    assert watcher.process.wait(timeout=30) == 130


def test_a_stage_inside_another_counts_for_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 0.0
    monkeypatch.setattr("dsl.observation.perf_counter", lambda: now)
    with observe() as observation:
        with stage("outer"):
            now += 1.0
            with stage("inner"):
                now += 10.0
                with stage("innermost"):
                    now += 100.0
            now += 2.0
        with suppress(ValueError), stage("inner"):
            now += 20.0
            raise ValueError
    assert observation.seconds == {"innermost": 100.0, "inner": 30.0, "outer": 3.0}
    with stage("unobserved"):
        pass
    assert "unobserved" not in observation.seconds


def test_files_are_noticed_whether_they_exist_or_not(tmp_path: Path) -> None:
    (tmp_path / "a.ovo").write_text("")
    with observe() as observation:
        Files().read_text(str(tmp_path / "a.ovo"))
        with pytest.raises(Exception, match="no file"):
            Files().read_text(str(tmp_path / "b.ovo"))
    assert set(observation.files) == {(tmp_path / name).resolve() for name in ("a.ovo", "b.ovo")}


def test_what_no_file_could_mend_ends_it(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["watch", str(folder / "ball.ovo"), "--output", "ball.xyz"]) == 3
    assert "xyz" in capsys.readouterr().err
