"""How much a program may spend: a hostile one wastes its budget and nothing more."""

from __future__ import annotations

from dsl.records import value


@value
class Limits:
    """What a program may spend; each limit has a `limit-…` diagnostic that names it.

    The defaults let every sensible scene through and end a hostile one within a minute.
    """

    source_bytes: int = 8_000_000
    """UTF-8 bytes of one source text."""
    nesting: int = 64
    """Brackets, blocks and prefix operators within one another."""
    diagnostics: int = 50
    """Faults that are reported; the run ends there."""
    steps: int = 20_000_000
    """Expressions evaluated, iterations begun, items copied; a fault counts as 500. An expression
    that is evaluated in n iterations at once counts as 1 + n/8: what keeps the limit one iteration
    after the other keeps it in any case."""
    call_depth: int = 1_000
    """Functions called within one another."""
    iterations: int = 2_000_000
    """Iterations of one loop."""
    nodes: int = 2_000_000
    """Nodes of the scene graph made; a batch counts by its placements."""
    list_length: int = 1_000_000
    """Items of one list, or maps of one transform."""
    string_length: int = 100_000
    """Characters of one string."""
    files: int = 256
    """Scene files used, directly or through others."""
    mesh_triangles: int = 100_000_000
    """Triangles of one mesh file."""


DEFAULT_LIMITS = Limits()
