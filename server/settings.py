"""What the service allows: every limit is one field here."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Settings:
    """The limits of one service. The defaults suit one machine and people who know each other."""

    max_body_bytes: int = 64 << 20
    """Longest body of arrays; longer ones are answered 413 without being read."""

    max_text_bytes: int = 8 << 20
    """Longest body of text or JSON, which takes some ten times as much once it is read."""

    max_pixels: int = 4096 * 4096
    """Most pixels of one picture."""

    max_camera_rays: int = 1 << 30
    """Most pixels × samples of one picture."""

    max_rays: int = 1_000_000
    """Most rays of one batch."""

    max_seconds: float = 60.0
    """Longest time one answer may take, waiting included; a request may ask for less."""

    running: int = 2
    """Scenes worked on at once; each render uses all cores."""

    waiting: int = 16
    """Requests that may wait for their turn; the next one is answered 503."""

    max_import_bytes: int = 4 << 30
    """Most memory that the import of one stage may take; stages are imported in processes of
    their own, which end with `max_seconds`."""

    hosts: tuple[str, ...] = ()
    """Names by which clients call the service, beside `localhost` and loopback addresses."""

    asset_root: Path | None = None
    """The folder whose files scenes may refer to; None: scenes may refer to none."""
