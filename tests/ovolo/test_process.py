"""The command as a process: pipes, terminals, signals."""

from __future__ import annotations

import os
import pty
import shlex
import signal
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent.parent
OVOLO = [sys.executable, "-m", "ovolo"]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm", "COLUMNS": "100"}
ENVIRONMENT.pop("NO_COLOR", None)
ENVIRONMENT.pop("PYTHONUNBUFFERED", None)  # with it Python does not see that a pipe is closed

SLOW = "sphere()\nsettings(width: 4000, height: 4000, samples: 4000)\n"


def on_a_terminal(folder: Path, arguments: list[str], **environment: str) -> tuple[int, str]:
    """Exit code and everything that a terminal shows."""
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [*OVOLO, *arguments],
        cwd=folder,
        env={**ENVIRONMENT, **environment},
        stdin=subprocess.DEVNULL,
        stdout=theirs,
        stderr=theirs,
    )
    os.close(theirs)
    shown = b""
    try:
        while chunk := os.read(ours, 4096):
            shown += chunk
    except OSError:  # Linux: the other side has been closed
        pass
    os.close(ours)
    return process.wait(timeout=60), shown.decode()


def test_diagnostics_are_coloured_on_a_terminal_only(tmp_path: Path) -> None:
    (tmp_path / "faulty.ovo").write_text("spher()\n")
    code, shown = on_a_terminal(tmp_path, ["check", "faulty.ovo"])
    assert code == 1
    assert "\x1b[1;31merror[name-unknown]" in shown
    _, plain = on_a_terminal(tmp_path, ["check", "faulty.ovo"], NO_COLOR="1")
    assert "\x1b[" not in plain
    piped = subprocess.run(
        [*OVOLO, "check", "faulty.ovo"], cwd=tmp_path, env=ENVIRONMENT, capture_output=True
    )
    assert b"\x1b[" not in piped.stderr


def test_quiet_pictures_of_all_formats_say_nothing_at_all(tmp_path: Path) -> None:
    (tmp_path / "ball.ovo").write_text("sphere()\nsettings(width: 8, height: 8, samples: 1)\n")
    outputs = [word for name in ("b.png", "b.jpg", "b.exr") for word in ("-o", name)]
    process = subprocess.run(
        [*OVOLO, "render", "ball.ovo", "--quiet", *outputs],
        cwd=tmp_path,
        env=ENVIRONMENT,
        capture_output=True,
    )
    assert (process.returncode, process.stdout, process.stderr) == (0, b"", b"")


def test_progress_is_shown_on_a_terminal(tmp_path: Path) -> None:
    (tmp_path / "ball.ovo").write_text("sphere()\n")
    code, shown = on_a_terminal(
        tmp_path, ["render", "ball.ovo", "--width", "160", "--height", "120", "--samples", "16"]
    )
    assert code == 0
    assert "Mrays/s" in shown
    assert "100%" in shown


def test_a_reader_who_leaves_is_no_fault(tmp_path: Path) -> None:
    (tmp_path / "many.ovo").write_text("for i in 0..20000 { sphere().translate(i, 0, 0) }\n")
    process = subprocess.Popen(
        [*OVOLO, "compile", "many.ovo", "--emit", "ir"],
        cwd=tmp_path,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    assert process.stdout is not None
    assert process.stderr is not None
    assert process.stdout.readline() == b"ovolo ir 1\n"
    process.stdout.close()
    assert process.stderr.read() == b""
    process.stderr.close()
    assert process.wait(timeout=60) == 141


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
@pytest.mark.parametrize("command", [["compile", "ball.ovo"], ["version"]])
def test_a_full_disk_is_told(tmp_path: Path, command: list[str]) -> None:
    (tmp_path / "ball.ovo").write_text("sphere()\n")
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*OVOLO, *command],
            cwd=tmp_path,
            env=ENVIRONMENT,
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
        )
    assert done.stderr == "error: the output cannot be written: No space left on device\n"
    assert done.returncode == 3


def test_output_that_was_closed_before_is_no_fault(tmp_path: Path) -> None:
    shell = f"exec {shlex.join([*OVOLO, 'version'])} >&-"
    done = subprocess.run(shell, shell=True, cwd=tmp_path, env=ENVIRONMENT, capture_output=True)
    assert (done.returncode, done.stderr) == (0, b"")


def test_ctrl_c_ends_a_render(tmp_path: Path) -> None:
    (tmp_path / "slow.ovo").write_text(SLOW)
    script = (
        "import os, signal, threading\n"
        "from ovolo.__main__ import main\n"
        "import runtime.render\n"
        "threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
        "raise SystemExit(main(['render', 'slow.ovo']))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert (done.returncode, done.stderr) == (130, "interrupted\n")
    assert not (tmp_path / "slow.png").exists()


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_any_encoding_of_the_output_will_do(tmp_path: Path, encoding: str) -> None:
    (tmp_path / "ball.ovo").write_text("sphere()\nsettings(width: 4, height: 4, samples: 1)\n")
    for arguments in (["render", "ball.ovo"], ["inspect", "ball.ovo"]):
        done = subprocess.run(
            [*OVOLO, *arguments],
            cwd=tmp_path,
            env={**ENVIRONMENT, "PYTHONIOENCODING": encoding},
            capture_output=True,
        )
        assert (done.returncode, done.stderr) == (0, b"")


def test_the_service_answers_on_a_port_and_ends(tmp_path: Path) -> None:
    import httpx2

    process = subprocess.Popen(
        [*OVOLO, "serve", "--port", "0"],
        cwd=tmp_path,
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        address = line.split()[2]
        assert address.startswith("http://127.0.0.1:")
        with httpx2.Client(base_url=address, timeout=60) as client:
            assert client.get("/healthz").json()["status"] == "ok"
            picture = client.post(
                "/v1/render?width=8&height=8&samples=1",
                content="sphere()",
                headers={"Content-Type": "text/plain"},
            )
            assert picture.content.startswith(b"\x89PNG")
        taken = subprocess.run(
            [*OVOLO, "serve", "--port", address.rpartition(":")[2]],
            cwd=tmp_path,
            env=ENVIRONMENT,
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert taken.returncode == 2
        assert "cannot listen on 127.0.0.1:" in taken.stderr
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=30) == 130
        process.stdout.close()
    finally:
        process.kill()
        process.wait()


def test_a_picture_without_memory_for_it_is_refused(tmp_path: Path) -> None:
    (tmp_path / "ball.ovo").write_text("sphere()\n")
    words = ["render", "ball.ovo", "--width", "8000", "--height", "8000", "--samples", "1"]
    limited = f"ulimit -v 1000000; exec {shlex.join([*OVOLO, *words])}"
    ended = subprocess.run(
        ["sh", "-c", limited],
        cwd=tmp_path,
        env={**ENVIRONMENT, "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
    )
    assert (ended.returncode, ended.stderr) == (2, "error: there is not enough memory for that\n")
    assert [path.name for path in tmp_path.iterdir()] == ["ball.ovo"]
