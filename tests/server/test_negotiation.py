from __future__ import annotations

import pytest

from server.negotiation import choose
from server.problems import Problem

OFFERED = ("image/png", "image/jpeg", "image/x-exr", "text/plain")


@pytest.mark.parametrize(
    ("accept", "chosen"),
    [
        (None, "image/png"),
        ("", "image/png"),
        ("*/*", "image/png"),
        ("image/*", "image/png"),
        ("image/x-exr", "image/x-exr"),
        ("IMAGE/JPEG", "image/jpeg"),
        ("image/webp, image/jpeg;q=0.5, image/png;q=0.4", "image/jpeg"),
        ("*/*;q=0.1, text/plain", "text/plain"),
        ("image/*;q=0.5, image/jpeg;q=0.9", "image/jpeg"),
        ("image/png;q=0, image/*", "image/jpeg"),
        ("image/png;q=high, text/plain;q=0.1", "text/plain"),
        ("text/html,application/xhtml+xml,image/avif,*/*;q=0.8", "image/png"),
        (",, image/jpeg ,", "image/jpeg"),
    ],
)
def test_the_best_rated_type_is_chosen(accept: str | None, chosen: str) -> None:
    assert choose(accept, OFFERED) == chosen


@pytest.mark.parametrize("accept", ["image/webp", "image/png;q=0", "audio/*", ";", "nonsense"])
def test_nothing_acceptable_is_a_problem(accept: str) -> None:
    with pytest.raises(Problem, match="image/png, image/jpeg") as caught:
        choose(accept, ("image/png", "image/jpeg"))
    assert caught.value.status == 406
