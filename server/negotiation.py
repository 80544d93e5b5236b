"""Content negotiation: which of the offered media types a client would rather have (RFC 9110)."""

from __future__ import annotations

from collections.abc import Sequence

from server.problems import Problem


def choose(accept: str | None, offered: Sequence[str]) -> str:
    """The offered media type that `accept` rates best, the earlier one on a tie.

    Without an `Accept` header it is the first. Raises the problem 406 if none is acceptable.
    """
    if not accept or not accept.strip():
        return offered[0]
    ranges = [_parse(item) for item in accept.split(",") if item.strip()]
    best = max(offered, key=lambda media_type: _quality(media_type, ranges))
    if _quality(best, ranges) <= 0.0:
        raise Problem(406, "not-acceptable", f"offered are {', '.join(offered)}, not {accept}")
    return best


def _parse(item: str) -> tuple[str, float]:
    media_range, *parameters = (part.strip().lower() for part in item.split(";"))
    quality = next((part[2:] for part in parameters if part.startswith("q=")), "1")
    try:
        return media_range, float(quality)
    except ValueError:
        return media_range, 0.0


def _quality(media_type: str, ranges: Sequence[tuple[str, float]]) -> float:
    """The rating by the most specific range that covers a media type, 0 if none does."""
    for pattern in (media_type, media_type.partition("/")[0] + "/*", "*/*"):
        ratings = [quality for media_range, quality in ranges if media_range == pattern]
        if ratings:
            return max(ratings)
    return 0.0
