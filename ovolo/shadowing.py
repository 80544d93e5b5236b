"""Our packages have everyday names: make sure that the ones Python finds are ours."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("dsl", "compiler", "runtime", "server")


def require_own_packages() -> None:
    """Raise ImportError, naming the culprit, if one of `PACKAGES` would come from elsewhere.

    A user's own `server.py` in the working folder would otherwise be imported in place of ours,
    and fail far from its cause. Nothing is imported to find out.
    """
    home = Path(__file__).resolve().parent.parent
    for name in PACKAGES:
        found = _location(name)
        if found is None:
            raise ImportError(f"ovolo is incomplete: its package `{name}` is not in {home}")
        if found != home / name / "__init__.py":
            raise ImportError(
                f"ovolo needs its own package `{name}` from {home}, but Python finds {found} "
                f"first: rename that file or folder, or run Python from another folder"
            )


def _location(name: str) -> Path | str | None:
    try:
        spec = find_spec(name)
    except ValueError:  # a module put into sys.modules by hand
        return f"one without a file, put into sys.modules as `{name}`,"
    if spec is None:
        return None
    if spec.origin is None:  # a folder without __init__.py
        return Path(next(iter(spec.submodule_search_locations or [name])))
    return Path(spec.origin).resolve()
