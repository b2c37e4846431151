"""A rope of segments: an immutable tree, edited and shifted in time anywhere at a cost that hardly grows with it.

Leaves hold segments with their stored times; a branch holds its children each with a time offset, so that shifting any
number of segments changes an offset a level. An edit makes new nodes only along its way down; all others are shared
with the ropes they came from, which stay as they were. Offsets are multiples of the time grid (`instant`): however
often they are added, the sums are exact. (Boehm, Atkinson, Plass: Ropes, an alternative to strings, 1995; the nodes
are those of a B+ tree, Comer 1979.)
"""

from __future__ import annotations

from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import accumulate, pairwise
from typing import TYPE_CHECKING, NamedTuple

from vrs_cli.trajectory.segment import Segment

if TYPE_CHECKING:
    from vrs_cli.trajectory.leaf_table import LeafTable

LEAF = 128  # segments in a full leaf
FAN = 32  # children of a full branch
SPARSE = 4  # a node that holds less than this part of a full one is put together with a neighbour,
MENDED = 2  # where both together hold at most this part of a full one


@dataclass(slots=True)
class Leaf:
    """Consecutive segments with the times they were made with, from `begin` to `end` [s]. Never changed once made.

    They are those from `first` to before `last` of a row that other leaves may have a part of: what an edit leaves of a
    leaf is not copied, nor even looked at (in a long timeline most of it is in no cache). `starts` stand side by side
    in memory: looking for a time touches few of its lines, and no segment. `table` holds the same as arrays, once it
    was asked for.
    """

    starts: array[float]
    row: tuple[Segment, ...]
    first: int
    last: int
    count: int
    begin: float
    end: float
    table: list[LeafTable] = field(default_factory=list, compare=False, repr=False)
    height = 0

    @property
    def segments(self) -> tuple[Segment, ...]:
        return self.row[self.first : self.last]


@dataclass(slots=True)
class Branch:
    """Children in time order, each `offsets` later than it says [s]. `begins`: their starts, that included; `counts`:
    segments before each, and in all. The numbers stand side by side in memory. Never changed once made."""

    height: int
    offsets: array[float]
    nodes: tuple[Node, ...]
    begins: array[float]
    counts: array[int]
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


def _leaf(segments: Sequence[Segment]) -> Leaf:
    starts = array("d", [segment.start for segment in segments])
    return Leaf(starts, tuple(segments), 0, len(segments), len(segments), starts[0], segments[-1].finish)


def _part(leaf: Leaf, first: int, last: int) -> Leaf:
    """The segments of a leaf from `first` to before `last`."""
    first, last = leaf.first + first, leaf.first + last
    return Leaf(leaf.starts, leaf.row, first, last, last - first, leaf.starts[first], leaf.row[last - 1].finish)


def _leaves_of(offset: float, segments: Sequence[Segment]) -> list[Held]:
    """Full leaves, the last one maybe not; the segments' times count from `offset`."""
    return [Held(offset, _leaf(segments[first : first + LEAF])) for first in range(0, len(segments), LEAF)]


def _branch(children: Sequence[Held]) -> Held:
    """A branch over nodes of one height."""
    offsets, nodes = array("d", [offset for offset, _ in children]), tuple([node for _, node in children])
    begins = array("d", [offset + node.begin for offset, node in children])
    counts = array("q", accumulate([node.count for node in nodes], initial=0))
    last = nodes[-1]
    made = Branch(last.height + 1, offsets, nodes, begins, counts, counts[-1], begins[0], offsets[-1] + last.end)
    return Held(0.0, made)


def _branches(children: Sequence[Held]) -> list[Held]:
    """As few branches as hold the children, about as many in each."""
    pieces = -(-len(children) // FAN)
    cuts = [len(children) * piece // pieces for piece in range(pieces + 1)] if pieces else []
    return [_branch(children[first:last]) for first, last in pairwise(cuts)]


def _root(level: list[Held]) -> Held | None:
    """One node over all, no higher than it must be."""
    while len(level) > 1:
        level = _branches(level)
    if not level:
        return None
    held = level[0]
    while isinstance(held.node, Branch) and len(held.node.nodes) == 1:
        held = Held(held.offset + held.node.offsets[0], held.node.nodes[0])
    return held


def rope_of(segments: Sequence[Segment]) -> Held | None:
    """A rope of segments in time order; None of none."""
    return _root(_leaves_of(0.0, segments))


# --- editing -----------------------------------------------------------------------------------------------------


def spliced(held: Held, first: int, last: int, new: Sequence[Segment], shift: float) -> Held | None:
    """`new` in place of the segments from index `first` to before `last`; all after them later by `shift` [s]."""
    return _root(_spliced(held, 0.0, first, last, new, shift))


def _spliced(held: Held, base: float, first: int, last: int, new: Sequence[Segment], shift: float) -> list[Held]:
    """Nodes of the same height; none where nothing is left. `base` is what the offset of `held` counts from."""
    offset, node = held
    if first == 0 and last >= node.count and not new:
        return []
    if isinstance(node, Leaf):
        return _spliced_leaf(offset, node, base, first, last, new, shift)
    counts = node.counts
    i = min(bisect_right(counts, first), len(node.nodes)) - 1
    j = max(bisect_left(counts, last) - 1, i)
    base += offset
    if i == j:
        middle = _spliced(_child(node, i), base, first - counts[i], last - counts[i], new, shift)
    else:
        middle = _spliced(_child(node, i), base, first - counts[i], node.nodes[i].count, new, 0.0)
        middle += _spliced(_child(node, j), base, 0, last - counts[j], (), shift)
    j += 1
    if not middle or any(_is_sparse(part.node) for part in middle):
        low, high = max(i - 1, 0), min(j + 1, len(node.nodes))
        middle = _mended(_children(node, low, i) + middle + _children(node, j, high, shift))
        i, j = low, high
    if middle and len(node.nodes) + len(middle) - (j - i) <= FAN:
        return [Held(offset, _patched(node, i, j, middle, shift))]
    row = _children(node, 0, i) + middle + _children(node, j, len(node.nodes), shift)
    return [part.shifted(offset) for part in _branches(row)]


def _patched(node: Branch, first: int, last: int, middle: list[Held], shift: float) -> Branch:
    """A branch with `middle` in place of the children from `first` to before `last`, those after it later by `shift`.

    What every edit does on every level: nothing is counted anew that stays.
    """
    counts = node.counts[:first] + array(
        "q", accumulate([part.node.count for part in middle], initial=node.counts[first])
    )
    more, later = counts[-1] - node.counts[last], node.counts[last + 1 :]
    after, begun = node.offsets[last:], node.begins[last:]
    if shift:
        after, begun = array("d", [t + shift for t in after]), array("d", [t + shift for t in begun])
    counts += array("q", [count + more for count in later]) if more else later
    offsets = node.offsets[:first] + array("d", [part.offset for part in middle]) + after
    begins = node.begins[:first] + array("d", [part.offset + part.node.begin for part in middle]) + begun
    nodes = (*node.nodes[:first], *[part.node for part in middle], *node.nodes[last:])
    return Branch(node.height, offsets, nodes, begins, counts, counts[-1], begins[0], offsets[-1] + nodes[-1].end)


def _child(node: Branch, place: int) -> Held:
    return Held(node.offsets[place], node.nodes[place])


def _children(node: Branch, first: int, last: int, shift: float = 0.0) -> list[Held]:
    """Those from `first` to before `last`, later by `shift`."""
    return [Held(node.offsets[place] + shift, node.nodes[place]) for place in range(first, last)]


def _spliced_leaf(
    offset: float, leaf: Leaf, base: float, first: int, last: int, new: Sequence[Segment], shift: float
) -> list[Held]:
    """What is before and after new segments stays where it is; behind the last one they are put on."""
    count = leaf.count
    if first and last >= count and first + len(new) <= LEAF:
        return [Held(offset, _leaf((*leaf.row[leaf.first : leaf.first + first], *_shifted(new, -(base + offset)))))]
    parts = [Held(offset, _part(leaf, 0, first))] if first else []
    parts += _leaves_of(offset, _shifted(new, -(base + offset)))
    return [*parts, Held(offset + shift, _part(leaf, last, count))] if last < count else parts


def _shifted(segments: Sequence[Segment], shift: float) -> Sequence[Segment]:
    return [segment.shifted(shift) for segment in segments] if shift else segments


def _mended(row: list[Held]) -> list[Held]:
    """A row of nodes in which sparse ones have joined the neighbour before them, where that has room."""
    made: list[Held] = []
    for held in row:
        if made and (_is_sparse(held.node) or _is_sparse(made[-1].node)):
            made[-1:] = _together(made[-1], held)
        else:
            made.append(held)
    return made


def _is_sparse(node: Node) -> bool:
    if isinstance(node, Leaf):
        return node.count * SPARSE < LEAF
    return len(node.nodes) * SPARSE < FAN


def _together(left: Held, right: Held) -> list[Held]:
    """Two neighbours of one height as one node, if that can hold both."""
    if isinstance(left.node, Branch) and isinstance(right.node, Branch):
        if (len(left.node.nodes) + len(right.node.nodes)) * MENDED > FAN:
            return [left, right]
        return [_branch([child for held in (left, right) for child in _shifted_children(held)])]
    if (left.node.count + right.node.count) * MENDED > LEAF:
        return [left, right]
    offset = max(left, right, key=lambda held: held.node.count).offset
    return [Held(offset, _leaf([*_moved(left, offset), *_moved(right, offset)]))]


def _shifted_children(held: Held) -> list[Held]:
    assert isinstance(held.node, Branch)
    return _children(held.node, 0, len(held.node.nodes), held.offset)


def _moved(held: Held, offset: float = 0.0) -> Sequence[Segment]:
    """The segments of a leaf, their times counted from `offset`."""
    assert isinstance(held.node, Leaf)
    return _shifted(held.node.segments, held.offset - offset)


# --- reading -----------------------------------------------------------------------------------------------------


def index_at(held: Held, t: float) -> int:
    """The index of the last segment that begins by time t; 0 before the first."""
    offset, node = held
    before = 0
    while isinstance(node, Branch):
        child = max(bisect_right(node.begins, t - offset) - 1, 0)
        before += node.counts[child]
        offset, node = offset + node.offsets[child], node.nodes[child]
    return before + max(bisect_right(node.starts, t - offset, node.first, node.last) - node.first - 1, 0)


def segment(held: Held, index: int) -> Segment:
    """The segment of an index, 0 <= index < count, at its time."""
    offset, node = held
    while isinstance(node, Branch):
        child = bisect_right(node.counts, index) - 1
        index -= node.counts[child]
        offset, node = offset + node.offsets[child], node.nodes[child]
    return node.row[node.first + index].shifted(offset)


def leaves(held: Held, first: float, last: float) -> Iterator[Held]:
    """The leaves that are in force at some time from `first` to `last`, in order."""
    offset, node = held
    if isinstance(node, Leaf):
        yield held
        return
    low = max(bisect_right(node.begins, first - offset) - 1, 0)
    high = max(bisect_right(node.begins, last - offset), low + 1)
    for child in _children(node, low, high, offset):
        yield from leaves(child, first, last)


def segments(held: Held) -> Iterator[Segment]:
    """All segments at their times."""
    offset, node = held
    if isinstance(node, Leaf):
        yield from _moved(held)
        return
    for child in _children(node, 0, len(node.nodes), offset):
        yield from segments(child)
