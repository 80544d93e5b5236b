"""`ovolo watch`."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

from dsl.diagnostics import CompileError
from dsl.observation import Observation, Stamp, asked_for, observe, stamp
from ovolo.commands import render
from ovolo.exits import Exit, StopError
from ovolo.terminal import print_stop, report


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments, which are those of `ovolo render`."""
    render.configure(parser)


def run(arguments: argparse.Namespace) -> Exit:
    """Render, and again whenever the scene or a file that it names has changed; until Ctrl-C."""
    while True:
        with observe() as observation:
            asked_for(arguments.scene.resolve())
            try:
                render.run(arguments)
            except CompileError as error:
                report(error.diagnostics)
            except StopError as stop:
                if not observation.seconds:
                    raise  # no change of a file could mend that
                print_stop(stop)
        print(_told(observation), file=sys.stderr, flush=True)
        _wait(observation.files)


def _told(observation: Observation) -> str:
    stages = [f"{name} {seconds:.3f} s" for name, seconds in observation.seconds.items()]
    return f"{', '.join(stages) or 'nothing was done'}; waiting for a change (Ctrl-C ends it)"


def _wait(files: Mapping[Path, Stamp]) -> None:
    """Return once a file is not what it was when it was asked for.

    Folders are watched, since editors replace files; and once a second the files are looked at,
    since some file systems do not tell.
    """
    from watchfiles import watch

    def changed() -> bool:
        return any(stamp(path) != before for path, before in files.items())

    folders = {next(p for p in path.parents if p.is_dir()) for path in files}
    if changed():
        return
    for _ in watch(
        *folders,
        watch_filter=None,
        recursive=False,
        debounce=200,
        step=30,
        rust_timeout=1000,
        yield_on_timeout=True,
        ignore_permission_denied=True,
    ):
        if changed():
            return
