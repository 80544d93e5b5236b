"""Subdivision surfaces: points on the limit of Catmull-Clark, Loop and bilinear refinement.

A cage is refined uniformly; then every point is moved to where it would end after infinitely many
refinements (the *limit*). Sharpness is that of semi-sharp creases: an edge of sharpness s is
refined by the rule of a sharp edge s times, and smoothly from then on; `INFINITE` and more is for
ever.

The end of a crease within a surface (a *dart*) is moved by the rule of smooth points, which is
not quite its limit, but meets it as refinement goes on.

Papers: Catmull and Clark, "Recursively generated B-spline surfaces on arbitrary topological
meshes" (1978); Loop, "Smooth subdivision surfaces based on triangles" (1987); DeRose, Kass and
Truong, "Subdivision surfaces in character animation" (1998), section 3 and appendices A and B
(creases, limits); Halstead, Kass and DeRose, "Efficient, fair interpolation using Catmull-Clark
surfaces" (1993), section 3 (limits).
"""

from __future__ import annotations

from compiler.subdivision.cage import INFINITE, Boundary, Cage, Creases, Scheme, cage
from compiler.subdivision.surface import Surface, limit_surface

__all__ = [
    "INFINITE",
    "Boundary",
    "Cage",
    "Creases",
    "Scheme",
    "Surface",
    "cage",
    "limit_surface",
]
