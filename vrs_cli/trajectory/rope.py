"""A rope of segments: an immutable tree that is cut, joined and shifted in time at a cost that hardly grows with it.

Leaves hold segments with their stored times; a branch holds its children each with a time offset, so that shifting any
number of segments changes one offset. Cutting and joining make new nodes only along the cut; all others are shared
with the ropes they came from, which stay as they were. Offsets are multiples of the time grid (`instant`): however
often they are added, the sums are exact. (Boehm, Atkinson, Plass: Ropes, an alternative to strings, 1995; the nodes
are those of a B-tree.)
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import TYPE_CHECKING, NamedTuple

from vrs_cli.trajectory.segment import Segment

if TYPE_CHECKING:
    from vrs_cli.trajectory.leaf_table import LeafTable

LEAF = 256  # segments in a full leaf
FAN = 64  # children of a full branch


@dataclass(frozen=True, slots=True)
class Leaf:
    """Consecutive segments with the times they were made with, from `begin` to `end` [s].

    `table` holds the same as arrays, once it was asked for.
    """

    starts: tuple[float, ...]
    segments: tuple[Segment, ...]
    count: int
    begin: float
    end: float
    table: list[LeafTable] = field(default_factory=list, compare=False, repr=False)
    height = 0


@dataclass(frozen=True, slots=True)
class Branch:
    """Children in time order. `begins`: their starts with their offsets; `counts`: segments before each, and in all."""

    height: int
    children: tuple[Held, ...]
    begins: tuple[float, ...]
    counts: tuple[int, ...]
    count: int
    begin: float
    end: float


Node = Leaf | Branch


class Held(NamedTuple):
    """A node whose times are all `offset` later than it says [s]."""

    offset: float
    node: Node

    def shifted(self, shift: float) -> Held:
        return Held(self.offset + shift, self.node) if shift else self


# --- making ------------------------------------------------------------------------------------------------------


def leaf_of(segments: Sequence[Segment]) -> Held:
    return Held(0.0, _leaf(tuple([segment.start for segment in segments]), tuple(segments)))


def _leaf(starts: tuple[float, ...], segments: tuple[Segment, ...]) -> Leaf:
    return Leaf(starts, segments, len(segments), starts[0], segments[-1].finish)


def branch_of(children: Sequence[Held]) -> Held:
    """A branch over nodes of one height."""
    begins = tuple([offset + node.begin for offset, node in children])
    counts = (0, *accumulate([node.count for _, node in children]))
    offset, last = children[-1]
    height = last.height + 1
    return Held(0.0, Branch(height, tuple(children), begins, counts, counts[-1], begins[0], offset + last.end))


def rope_of(segments: Sequence[Segment]) -> Held | None:
    """A rope of segments in time order; None of none."""
    level = [leaf_of(segments[first : first + LEAF]) for first in range(0, len(segments), LEAF)]
    while len(level) > 1:
        level = [branch_of(level[first : first + FAN]) for first in range(0, len(level), FAN)]
    return level[0] if level else None


# --- joining and cutting -----------------------------------------------------------------------------------------


def joined(left: Held | None, right: Held | None) -> Held | None:
    """All of `left`, then all of `right`."""
    if left is None or right is None:
        return left or right
    parts = _together(left, right)
    return parts[0] if len(parts) == 1 else branch_of(parts)


def _together(left: Held, right: Held) -> list[Held]:
    """One or two nodes, of the height of the higher one, that hold both."""
    if left.node.height == right.node.height:
        if isinstance(left.node, Leaf) and isinstance(right.node, Leaf):
            return _joined_leaves(left, right)
        return _packed([*_children(left), *_children(right)])
    if left.node.height > right.node.height:
        return _packed_onto(left, _together(_child(left, -1), right))
    return _packed(_together(left, _child(right, 0)) + _children(right)[1:])


def _joined_leaves(left: Held, right: Held) -> list[Held]:
    """Small leaves become one, so that many edits in one place leave no crumbs."""
    if left.node.count + right.node.count > LEAF:
        return [left, right]
    segments = [*_moved(left), *_moved(right)]
    return [leaf_of(segments)]


def _moved(leaf: Held) -> tuple[Segment, ...]:
    assert isinstance(leaf.node, Leaf)
    offset, segments = leaf.offset, leaf.node.segments
    return tuple([segment.shifted(offset) for segment in segments]) if offset else segments


def _children(held: Held) -> list[Held]:
    assert isinstance(held.node, Branch)
    shift = held.offset
    if not shift:
        return list(held.node.children)
    return [Held(offset + shift, node) for offset, node in held.node.children]


def _child(held: Held, place: int) -> Held:
    assert isinstance(held.node, Branch)
    return held.node.children[place].shifted(held.offset)


def _packed_onto(held: Held, last: list[Held]) -> list[Held]:
    """A branch with its last child replaced by one or two: what appending does, again and again."""
    offset, node = held
    assert isinstance(node, Branch)
    if len(node.children) + len(last) - 1 > FAN:
        return _packed([*_children(held)[:-1], *last])
    local = [part.shifted(-offset) for part in last]
    counts = (*node.counts[:-2], *accumulate([part.node.count for part in local], initial=node.counts[-2]))
    begins = (*node.begins[:-1], *[part.offset + part.node.begin for part in local])
    end = local[-1].offset + local[-1].node.end
    children = (*node.children[:-1], *local)
    return [Held(offset, Branch(node.height, children, begins, counts, counts[-1], begins[0], end))]


def _packed(children: list[Held]) -> list[Held]:
    if len(children) <= FAN:
        return [branch_of(children)]
    half = len(children) // 2
    return [branch_of(children[:half]), branch_of(children[half:])]


def cut(held: Held | None, index: int) -> tuple[Held | None, Held | None]:
    """The first `index` segments, and the others."""
    if held is None or index <= 0:
        return None, held
    if index >= held.node.count:
        return held, None
    node = held.node
    if isinstance(node, Leaf):
        return _leaf_part(held, 0, index), _leaf_part(held, index, node.count)
    child = bisect_right(node.counts, index) - 1
    left, right = cut(node.children[child].shifted(held.offset), index - node.counts[child])
    before, after = _row(held, 0, child), _row(held, child + 1, len(node.children))
    return joined(before, left), joined(right, after)


def _leaf_part(held: Held, first: int, last: int) -> Held:
    assert isinstance(held.node, Leaf)
    return Held(held.offset, _leaf(held.node.starts[first:last], held.node.segments[first:last]))


def _row(held: Held, first: int, last: int) -> Held | None:
    """The children from `first` to before `last`, under a branch if they are several."""
    offset, node = held
    assert isinstance(node, Branch)
    if last - first < 2:
        return node.children[first].shifted(offset) if last > first else None
    before = node.counts[first]
    counts = node.counts[first : last + 1]
    if before:
        counts = tuple([count - before for count in counts])
    children, begins = node.children[first:last], node.begins[first:last]
    end = children[-1].offset + children[-1].node.end
    return Held(offset, Branch(node.height, children, begins, counts, counts[-1], begins[0], end))


# --- reading -----------------------------------------------------------------------------------------------------


def index_at(held: Held, t: float) -> int:
    """The index of the last segment that begins by time t; 0 before the first."""
    offset, node = held
    before = 0
    while isinstance(node, Branch):
        child = max(bisect_right(node.begins, t - offset) - 1, 0)
        before += node.counts[child]
        more, node = node.children[child]
        offset += more
    return before + max(bisect_right(node.starts, t - offset) - 1, 0)


def segment(held: Held, index: int) -> Segment:
    """The segment of an index, 0 <= index < count, at its time."""
    offset, node = held
    while isinstance(node, Branch):
        child = bisect_right(node.counts, index) - 1
        index -= node.counts[child]
        more, node = node.children[child]
        offset += more
    return node.segments[index].shifted(offset)


def leaves(held: Held, first: float, last: float) -> Iterator[Held]:
    """The leaves that are in force at some time from `first` to `last`, in order."""
    offset, node = held
    if isinstance(node, Leaf):
        yield held
        return
    low = max(bisect_right(node.begins, first - offset) - 1, 0)
    high = max(bisect_right(node.begins, last - offset), low + 1)
    for child in node.children[low:high]:
        yield from leaves(child.shifted(offset), first, last)


def segments(held: Held) -> Iterator[Segment]:
    """All segments at their times."""
    offset, node = held
    if isinstance(node, Leaf):
        yield from _moved(held)
        return
    for child in node.children:
        yield from segments(child.shifted(offset))
