"""Equal branches become one, so that a group that is built again and again is stored once.

Two branches are equal if their edges are: with the same chains to the last bit, the same materials
and segments of the path, to equal branches. Only scenes too large to be flattened gain by it.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import replace

from compiler.compress import Branches, Chain, Edge


def merged(branches: Branches) -> Branches:
    """The branches without those that equal another; children first, the root last."""
    chains = _numbered([_chain_key(chain, branches.chains) for chain in branches.chains])
    result = Branches(chains=branches.chains)
    numbers: list[int] = []  # the new number of each branch
    known: dict[Hashable, int] = {}
    root = len(branches.edges) - 1
    for branch, old in enumerate(branches.edges):
        edges = tuple(
            replace(
                edge,
                target=edge.target if edge.target >= 0 else ~numbers[~edge.target],
                chain=edge.chain if edge.chain < 0 else chains[edge.chain],
            )
            for edge in old
        )
        order = branches.orders.get(branch)
        key = (tuple(map(_edge_key, edges)), None if order is None else order.tobytes())
        number = len(result.edges)
        if branch != root:
            number = known.setdefault(key, number)
        numbers.append(number)
        if number == len(result.edges):
            result.edges.append(edges)
            if order is not None:
                result.orders[number] = order
    return result


def _numbered(keys: list[Hashable]) -> list[int]:
    """For each key the place of the first that equals it."""
    first: dict[Hashable, int] = {}
    return [first.setdefault(key, place) for place, key in enumerate(keys)]


def _chain_key(chain: Chain, chains: Sequence[Chain]) -> Hashable:
    apart = tuple(len(chains[part].steps) for part in chain.apart)
    steps = ((s.kind, s.inverse, s.values.shape, s.values.tobytes()) for s in chain.steps)
    return chain.count, tuple(steps), apart


def _edge_key(edge: Edge) -> Hashable:
    indices = None if edge.indices is None else edge.indices.tobytes()
    return (
        edge.target,
        edge.chain,
        edge.count,
        edge.material,
        edge.segments,
        edge.batch,
        indices,
    )
