"""A first walk over a scene graph: files are read, nodes put into order, references counted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from dsl.diagnostics import Diagnostic
from dsl.scene import Bind, File, Group, Instances, Node, Shape

Load = Callable[[File], tuple[Node | None, list[Diagnostic]]]
"""Reads the object of a file; None and an error among the diagnostics if that fails."""

_EMPTY = Group(())


@dataclass(slots=True)
class Walk:
    """Every reachable node of a graph once, children before parents, siblings as emitted.

    `references` counts, by `id`, the placements of each node, every lane of a batch as one.
    """

    root: Node
    order: list[Node] = field(default_factory=list)
    references: dict[int, int] = field(default_factory=dict)
    contents: dict[int, Node] = field(default_factory=dict)
    diagnostics: list[Diagnostic] = field(default_factory=list)

    def children(self, node: Node) -> tuple[Node, ...]:
        """The nodes right below `node`; a file's is what was read from it."""
        if isinstance(node, Instances):
            return (node.child,)
        if isinstance(node, Group):
            return node.items
        if isinstance(node, Bind):
            return (node.child,)
        if isinstance(node, File):
            return (self.contents[id(node)],)
        return ()


def walk(root: Node, load: Load) -> Walk:
    """Go over the graph below `root`, of any depth; equal `File`s are read once."""
    result = Walk(root)
    read: dict[tuple[str, str, str | None, str | None], Node] = {}
    entered: set[int] = set()
    stack: list[Node | None] = [root]
    while stack:
        node = stack.pop()
        if node is None:  # all below the next one is in order
            if (above := stack.pop()) is not None:
                result.order.append(above)
            continue
        if id(node) in entered:
            continue
        entered.add(id(node))
        if type(node) is Shape:
            result.order.append(node)
            continue
        if isinstance(node, File):
            key = (node.kind, node.path, node.prim, node.folder)
            if key not in read:
                content, diagnostics = load(node)
                read[key] = content or _EMPTY
                result.diagnostics += diagnostics
            result.contents[id(node)] = read[key]
        lanes = node.transform.count if isinstance(node, Instances) else None
        children = result.children(node) if lanes != 0 else ()
        if not children:
            result.order.append(node)
            continue
        for child in children:
            result.references[id(child)] = result.references.get(id(child), 0) + (lanes or 1)
        stack += (node, None, *reversed(children))
    return result
