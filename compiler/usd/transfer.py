"""Scene graphs as bytes, from the process that made them to another.

A graph may be deeper than pickle can descend, so its nodes are listed children first, and refer to
each other by number. What is shared stays shared.
"""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import NamedTuple

from compiler.walk import walk
from dsl.diagnostics import Diagnostic
from dsl.scene import Bind, Group, Instances, Node, SceneGraph


class _Kept(NamedTuple):
    """A node without those below it, which are `below` by number."""

    node: Node
    below: tuple[int, ...]


_NOTHING = Group(())


def to_bytes(graph: SceneGraph, diagnostics: list[Diagnostic]) -> bytes:
    """A graph and the diagnostics beside it."""
    order = walk(graph.root, lambda file: (file, [])).order
    numbers = {id(node): number for number, node in enumerate(order)}
    kept = [_Kept(_alone(node), tuple(numbers[id(b)] for b in _below(node))) for node in order]
    return pickle.dumps((kept, graph.name, graph.sources, diagnostics), protocol=5)


def from_bytes(content: bytes) -> tuple[SceneGraph, list[Diagnostic]]:
    """What `to_bytes` was given. Only for bytes of a process that is our own."""
    kept, name, sources, diagnostics = pickle.loads(content)
    nodes: list[Node] = []
    for node, below in kept:
        nodes.append(_joined(node, [nodes[number] for number in below]))
    return SceneGraph(nodes[-1], name, sources), diagnostics


def _below(node: Node) -> tuple[Node, ...]:
    match node:
        case Group():
            return node.items
        case Instances() | Bind():
            return (node.child,)
        case _:
            return ()


def _alone(node: Node) -> Node:
    match node:
        case Group():
            return replace(node, items=())
        case Instances() | Bind():
            return replace(node, child=_NOTHING)
        case _:
            return node


def _joined(node: Node, below: list[Node]) -> Node:
    match node:
        case Group():
            return replace(node, items=tuple(below))
        case Instances() | Bind():
            return replace(node, child=below[0])
        case _:
            return node
