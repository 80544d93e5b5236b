"""The reference interpreter: the seed's method, written to be read.

A transformed object is intersected by transforming the *ray* (Suffern, *Ray Tracing from the
Ground Up*, 2007, chapter 21). For an instance that places an object by T:

1. transform the ray by the inverse of T;
2. intersect it with the untransformed object: the hit point p, at some t;
3. take the normal n of the untransformed object at p;
4. the hit point on the instance is T p, at the same t, for directions are never normalised;
5. the normal of the instance is T⁻ᵀ n.

An object may itself be an instance, or a group of them, so this is a recursion over the scene
graph: `interpret` is that recursion, `transform` has the elementary maps, `intersect` the shapes:
plain ones by the intervals of `plain_solid`, bevelled ones by `signed_distance` and `march`.
Nothing is composed, flattened or bounded, every ray meets every leaf, and the numbers may be
float64, longdouble or mpmath's: slow and obvious, an oracle for the compiler and the kernel, with
which it shares no code.
"""

from runtime.reference.interpret import ReferenceTracer

__all__ = ["ReferenceTracer"]
