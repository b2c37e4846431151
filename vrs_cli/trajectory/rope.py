"""A rope of segments: an immutable tree that can be edited and shifted in time anywhere, at a cost that hardly grows
with its size.

Segments are stored in rows. A leaf is a part of a row. After an edit, the remainder of a leaf is a smaller part of the
same row; the row is neither copied nor read. A row grows only at its end, so appending needs no copy either: older
leaves do not see the new segments, since each leaf knows its end. A branch holds leaves or branches with the times at
which they begin, which may differ from the times stored in the rows. So to shift any number of segments, only a few
stored times change on each level. An edit makes new nodes only along its path down the tree; all other nodes are shared
with the old rope, which stays unchanged. Times are multiples of the time grid (`instant`): however often they are
shifted, the sums are exact. (Boehm, Atkinson, Plass: Ropes, an alternative to strings, 1995; the nodes are those of a
B+ tree, Comer 1979, with leaves of any length.)
"""

from __future__ import annotations

from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Sequence
from itertools import accumulate, pairwise
from math import inf
from threading import Lock
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

from msgspec import Struct

from vrs_cli.trajectory.row import BlockTable, EventRow, Row, later, table_of
from vrs_cli.trajectory.segment import Path, Segment
from vrs_cli.values.commands import Event

SMALL_LEAF = 128  # a leaf with at most this many segments may be copied; longer leaves are only cut
BLOCK_LENGTH = 128  # number of segments of a row that are read as arrays at once
MAX_CHILDREN = 32  # maximum number of children of a branch
SPARSE_DIVISOR = 4  # a node with less than 1/4 of SMALL_LEAF or MAX_CHILDREN may be merged with a neighbour
MERGED_DIVISOR = 2  # two nodes are merged if they have at most 1/2 of SMALL_LEAF or MAX_CHILDREN together


class Columns(Protocol):
    """Rows of segments (`Row`) or events (`EventRow`) as columns of plain numbers; the leaves of a rope are parts of
    them.
    """

    closed: bool

    def __init__(self, rows: Iterable[Any] = ()) -> None: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int, /) -> Any: ...
    @property
    def starts(self) -> array[float]: ...
    @property
    def finishes(self) -> array[float]: ...
    def between(self, first: int, last: int) -> Iterator[Any]: ...
    def grow(self, rows: Iterable[Any], /) -> None: ...
    def take(self, other: Any, first: int, last: int, shift: float) -> None: ...


R = TypeVar("R", bound=Columns)
Shiftable = TypeVar("Shiftable", Segment, Event)


class ChannelChanges(Struct, frozen=True):
    """The changes of one channel in a branch: `places`, the indices of the children that change it, and `values`, the
    value of the channel after each of these children.
    """

    places: array[int]
    values: array[float]


class Leaf(Struct, Generic[R], gc=False):
    """The segments of a row from `first` up to, but not including, `last`, from time `begin` to `end` [s]. A leaf never
    changes, except `values`: for a leaf of events, the values of the channels after it, computed on demand.
    """

    row: R
    first: int
    last: int
    begin: float
    end: float
    values: dict[int, float] | None = None
    height = 0

    @property
    def count(self) -> int:
        return self.last - self.first


class Branch(Struct, Generic[R], gc=False):
    """Children in time order, each shifted so that it begins at its time in `begins` [s]. `counts`: the number of
    segments before each child, and the total at the end. The numbers are contiguous in memory. A branch never changes,
    except `changes`: for a branch of events, which children change each channel, computed on demand.
    """

    height: int
    nodes: tuple[Node[R], ...]
    begins: array[float]
    counts: array[int]
    count: int
    begin: float
    end: float
    changes: dict[int, ChannelChanges] | None = None


Node = Leaf[R] | Branch[R]


class OffsetNode(NamedTuple, Generic[R]):
    """A node and the `offset` [s] that is added to all its times."""

    offset: float
    node: Node[R]

    def shift_by(self, shift: float) -> OffsetNode[R]:
        return OffsetNode(self.offset + shift, self.node) if shift else self


class RowPart(Struct, frozen=True):
    """Segments of a row from `first` up to, but not including, `last`, at most BLOCK_LENGTH of them. Their times are
    `offset` [s] later than in the row.
    """

    offset: float
    row: Row
    first: int
    last: int

    @property
    def begin(self) -> float:
        return self.offset + self.row.starts[self.first]

    def times(self) -> tuple[array[float], array[float]]:
        """Return when the segments start and when they finish [s]."""
        part = slice(self.first, self.last)
        return later(self.row.starts[part], self.offset), later(self.row.finishes[part], self.offset)

    def table(self) -> tuple[BlockTable, slice]:
        """Return the table that contains the block, and the slice of the block in it."""
        number, first = divmod(self.first, BLOCK_LENGTH)
        part = slice(first, first + self.last - self.first)
        table = self.row.tables.get(number)
        if table is None or len(table.starts) < part.stop:  # the row has grown since the table was made
            table = self.row.tables[number] = table_of(self.row, number * BLOCK_LENGTH, (number + 1) * BLOCK_LENGTH)
        return table, part


# --- making ------------------------------------------------------------------------------------------------------


def _leaf(row: R) -> Leaf[R]:
    """Make a leaf that covers a whole row."""
    count = len(row)
    return Leaf(row, 0, count, row.starts[0], row.finishes[count - 1])


def _part(leaf: Leaf[R], first: int, last: int) -> Leaf[R]:
    """Make a leaf that covers the segments of a leaf from `first` up to, but not including, `last`."""
    row, first, last = leaf.row, leaf.first + first, leaf.first + last
    return Leaf(row, first, last, row.starts[first], row.finishes[last - 1])


def _row_like(leaf: Leaf[R], new: Sequence[Any] = ()) -> R:
    """Make a row of the kind (segments or events) that the leaf has, with the given content."""
    return type(leaf.row)(new)


def _copy(leaf: Leaf[R], count: int) -> R:
    """Copy the first segments of a leaf into a new row."""
    row = _row_like(leaf)
    row.take(leaf.row, leaf.first, leaf.first + count, 0.0)
    return row


def _with_growth(leaf: Leaf[R]) -> Leaf[R]:
    """Make a leaf that also has the segments that were appended to its row later."""
    row, last = leaf.row, len(leaf.row)
    return Leaf(row, leaf.first, last, leaf.begin, row.finishes[last - 1])


def _ends_row(node: Node[R]) -> bool:
    """Return whether a node is a leaf at the end of a row that may still grow."""
    return isinstance(node, Leaf) and not node.row.closed and node.last == len(node.row)


def _branch(children: Sequence[OffsetNode[R]]) -> OffsetNode[R]:
    """Make a branch whose children are these nodes, all of the same height."""
    nodes = tuple([node for _, node in children])
    begins = array("d", [offset + node.begin for offset, node in children])
    counts = array("q", accumulate([node.count for node in nodes], initial=0))
    offset, last = children[-1]
    return OffsetNode(0.0, Branch(last.height + 1, nodes, begins, counts, counts[-1], begins[0], offset + last.end))


def _branches(children: Sequence[OffsetNode[R]]) -> list[OffsetNode[R]]:
    """Distribute the children over as few branches as possible, about the same number to each."""
    pieces = -(-len(children) // MAX_CHILDREN)
    cuts = [len(children) * piece // pieces for piece in range(pieces + 1)] if pieces else []
    return [_branch(children[first:last]) for first, last in pairwise(cuts)]


def root(level: list[OffsetNode[R]]) -> OffsetNode[R] | None:
    """Return the root of the lowest tree over nodes that have the same height and are in time order; None for
    no nodes.
    """
    while len(level) > 1:
        level = _branches(level)
    if not level:
        return None
    held = level[0]
    while isinstance(held.node, Branch) and len(held.node.nodes) == 1:
        held = _child(held.node, 0).shift_by(held.offset)
    return held


def rope_of(row: R) -> OffsetNode[R] | None:
    """Make a rope that contains a whole row; return None for an empty row."""
    return OffsetNode(0.0, _leaf(row)) if len(row) else None


def parts(held: OffsetNode[R], index: int = 0, before: int = 0) -> Iterator[tuple[int, float, Leaf[R]]]:
    """Yield the leaves, starting with the leaf that contains segment number `index`. Each is yielded with the number of
    its first segment and the offset of its times [s]. `before`: the number of segments before the node.
    """
    offset, node = held
    if isinstance(node, Leaf):
        yield before, offset, node
        return
    for number in range(max(bisect_right(node.counts, index - before) - 1, 0), len(node.nodes)):
        yield from parts(_child(node, number).shift_by(offset), index, before + node.counts[number])


def common(a: OffsetNode[R] | None, b: OffsetNode[R] | None) -> int:
    """Return a lower bound for the number of segments or events that two ropes share at their start. Only leaves are
    compared, not single segments.
    """
    if a is None or b is None:
        return 0
    count = 0
    for (_, here, one), (_, there, other) in zip(parts(a), parts(b), strict=False):
        if here != there or one.row is not other.row or one.first != other.first:
            break
        count += min(one.count, other.count)
        if one.last != other.last:
            break
    return count


def columns(held: OffsetNode[Row], index: int) -> Iterator[tuple[float, float, Path]]:
    """Yield start [s], finish [s] and path of each segment, from number `index` on."""
    for number, offset, leaf in parts(held, index):
        row = leaf.row
        for place in range(leaf.first + max(0, index - number), leaf.last):
            yield offset + row.starts[place], offset + row.finishes[place], row.paths[place]


def in_rows(held: OffsetNode[Row], most: int) -> OffsetNode[Row]:
    """Return the same rope, with rows in memory cut to at most `most` segments."""
    pieces: list[OffsetNode[Row]] = []
    for _, offset, leaf in parts(held):
        if leaf.row.away or len(leaf.row) <= most:
            pieces.append(OffsetNode(offset, leaf))
            continue
        for first in range(0, leaf.count, most):
            row = Row()
            row.take(leaf.row, leaf.first + first, leaf.first + min(first + most, leaf.count), 0.0)
            pieces.append(OffsetNode(offset, _leaf(row)))
    made = root(pieces)
    assert made is not None
    return made


# --- editing -----------------------------------------------------------------------------------------------------

_EDITING = Lock()  # held while a rope is edited, so that two threads do not append to the same row


def splice(held: OffsetNode[R], first: int, last: int, new: Sequence[Any], shift: float) -> OffsetNode[R] | None:
    """Replace the segments from index `first` up to, but not including, `last` by `new`, and shift all later ones by
    `shift` [s].
    """
    with _EDITING:
        return root(_splice(held, 0.0, first, last, new, shift))


def _splice(
    held: OffsetNode[R], base: float, first: int, last: int, new: Sequence[Any], shift: float
) -> list[OffsetNode[R]]:
    """Do what `splice` does in one node. Return the nodes that replace it, all of the same height; none if nothing is
    left. `base`: the time to which the offset of `held` is added [s].
    """
    offset, node = held
    if first == 0 and last >= node.count and not new:
        return []
    if isinstance(node, Leaf):
        return _splice_leaf(offset, node, base, first, last, new, shift)
    counts = node.counts
    i = min(bisect_right(counts, first), len(node.nodes)) - 1
    j = max(bisect_left(counts, last) - 1, i)
    base += offset
    if i == j:
        middle = _splice(_child(node, i), base, first - counts[i], last - counts[i], new, shift)
    else:
        middle = _splice(_child(node, i), base, first - counts[i], node.nodes[i].count, new, 0.0)
        middle += _splice(_child(node, j), base, 0, last - counts[j], (), shift)
    j += 1
    if not middle or any(_is_sparse(part.node) for part in middle):
        low, high = max(i - 1, 0), min(j + 1, len(node.nodes))
        middle = _merge_sparse(_children(node, low, i) + middle + _children(node, j, high, shift))
        i, j = low, high
    if middle and len(node.nodes) + len(middle) - (j - i) <= MAX_CHILDREN:
        return [OffsetNode(offset, _patch(node, i, j, middle, shift))]
    row = _children(node, 0, i) + middle + _children(node, j, len(node.nodes), shift)
    return [part.shift_by(offset) for part in _branches(row)]


def _patch(node: Branch[R], first: int, last: int, middle: list[OffsetNode[R]], shift: float) -> Branch[R]:
    """Make a branch with `middle` in place of the children from `first` up to, but not including, `last`; the children
    after them are shifted by `shift` [s].

    Every edit calls this on every level of the tree, so the counts of unchanged children are reused.
    """
    counts = node.counts[:first]
    counts.extend(accumulate([part.node.count for part in middle], initial=node.counts[first]))
    more, later = counts[-1] - node.counts[last], node.counts[last + 1 :]
    counts.extend([count + more for count in later] if more else later)
    begins = node.begins[:first]
    begins.extend([offset + part.begin for offset, part in middle])
    begins.extend([t + shift for t in node.begins[last:]] if shift else node.begins[last:])
    nodes = (*node.nodes[:first], *[part for _, part in middle], *node.nodes[last:])
    end = begins[-1] - nodes[-1].begin + nodes[-1].end
    return Branch(node.height, nodes, begins, counts, counts[-1], begins[0], end)


def _child(node: Branch[R], place: int) -> OffsetNode[R]:
    child = node.nodes[place]
    return OffsetNode(node.begins[place] - child.begin, child)


def _children(node: Branch[R], first: int, last: int, shift: float = 0.0) -> list[OffsetNode[R]]:
    """Return the children from `first` up to, but not including, `last`, shifted by `shift` [s]."""
    row = zip(node.begins[first:last], node.nodes[first:last], strict=True)
    return [OffsetNode(begin - child.begin + shift, child) for begin, child in row]


def _splice_leaf(
    offset: float, leaf: Leaf[R], base: float, first: int, last: int, new: Sequence[Any], shift: float
) -> list[OffsetNode[R]]:
    """Return the leaves that replace a leaf in `_splice`. The segments before and after the new ones stay in
    their row.
    """
    count = leaf.count
    new = list(_shift_rows(new, -(base + offset)))
    if isinstance(leaf.row, EventRow) and not shift and first < count:
        return [OffsetNode(offset, part) for part in _edited_copy(leaf, first, last, new)]
    if last < count:
        parts = [OffsetNode(offset, _part(leaf, 0, first))] if first else []
        parts += [OffsetNode(offset, _leaf(_row_like(leaf, new)))] if new else []
        return [*parts, OffsetNode(offset + shift, _part(leaf, last, count) if last else leaf)]
    return [OffsetNode(offset, part) for part in _replace_end(leaf, first, new)]


def _edited_copy(leaf: Leaf[R], first: int, last: int, new: Sequence[Any]) -> list[Leaf[R]]:
    """Replace the events of a leaf from `first` up to, but not including, `last` by `new` in a copy of the leaf, which
    is split into two leaves if it is long. At least one event must remain.
    """
    row: Any = leaf.row
    whole: Leaf[R] = _leaf(row.with_edit(leaf.first, leaf.first + first, new, leaf.first + last, leaf.last))
    if whole.count <= SMALL_LEAF:
        return [whole]
    half = whole.count // 2
    return [_part(whole, 0, half), _part(whole, half, whole.count)]


def _replace_end(leaf: Leaf[R], first: int, new: Sequence[Any]) -> list[Leaf[R]]:
    """Replace segment `first` of a leaf and all later ones by `new`."""
    if not new:
        return [_part(leaf, 0, first)]
    if not first:
        return [_leaf(_row_like(leaf, new))]
    if first == leaf.count and _ends_row(leaf):
        leaf.row.grow(new)
        return [_with_growth(leaf)]
    if first == leaf.count > SMALL_LEAF // 2:
        return [leaf, _leaf(_row_like(leaf, new))]
    if first + len(new) <= SMALL_LEAF:
        row = _copy(leaf, first)
        row.grow(new)
        return [_leaf(row)]
    # a copy ends its own row, so it can grow
    kept = _leaf(_copy(leaf, first)) if first <= SMALL_LEAF else _part(leaf, 0, first)
    return [kept, _leaf(_row_like(leaf, new))]


def _shift_rows(rows: Iterable[Shiftable], shift: float) -> Iterator[Shiftable]:
    return (one.shift_by(shift) for one in rows) if shift else iter(rows)


def _merge_sparse(row: list[OffsetNode[R]]) -> list[OffsetNode[R]]:
    """Merge sparse nodes into the neighbour before them if there is room. A small leaf is appended to the row of the
    leaf before it if more nodes follow.
    """
    made: list[OffsetNode[R]] = []
    for place, held in enumerate(row):
        if made and (_is_sparse(held.node) or _is_sparse(made[-1].node)):
            made[-1:] = _merge_neighbours(made[-1], held)
        elif made and place < len(row) - 1 and _ends_row(left := made[-1].node) and held.node.count <= SMALL_LEAF:
            assert isinstance(left, Leaf)
            _take(left.row, held, made[-1].offset)
            made[-1] = OffsetNode(made[-1].offset, _with_growth(left))
        else:
            made.append(held)
    return made


def _is_sparse(node: Node[R]) -> bool:
    if isinstance(node, Leaf):
        return node.count * SPARSE_DIVISOR < SMALL_LEAF
    return len(node.nodes) * SPARSE_DIVISOR < MAX_CHILDREN


def _merge_neighbours(left: OffsetNode[R], right: OffsetNode[R]) -> list[OffsetNode[R]]:
    """Merge two neighbours of the same height into one node, if one node can hold both."""
    a, b = left.node, right.node
    if isinstance(a, Branch) and isinstance(b, Branch):
        if (len(a.nodes) + len(b.nodes)) * MERGED_DIVISOR > MAX_CHILDREN:
            return [left, right]
        pairs = ((a, left.offset), (b, right.offset))
        return [_branch([child for node, by in pairs for child in _children(node, 0, len(node.nodes), by)])]
    if (left.node.count + right.node.count) * MERGED_DIVISOR > SMALL_LEAF:
        return [left, right]
    offset = max(left, right, key=lambda held: held.node.count).offset
    assert isinstance(a, Leaf)
    row = _row_like(a)
    _take(row, left, offset)
    _take(row, right, offset)
    return [OffsetNode(offset, _leaf(row))]


def _take(row: R, held: OffsetNode[R], offset: float) -> None:
    """Append the segments of a leaf to a row, with times relative to `offset`."""
    leaf = held.node
    assert isinstance(leaf, Leaf)
    row.take(leaf.row, leaf.first, leaf.last, held.offset - offset)


# --- reading -----------------------------------------------------------------------------------------------------


def locate(held: OffsetNode[Row], t: float) -> tuple[Row, int, float]:
    """Find the last segment that begins by time t [s], or the first segment if t is earlier: return its row, its index
    in the row, and the time from its start to t [s], at most its duration.
    """
    offset, node = held
    while node.__class__ is Branch:  # not isinstance, since this is the most frequent query
        place = bisect_right(node.begins, t - offset) - 1
        place = place if place > 0 else 0
        offset += node.begins[place]
        node = node.nodes[place]
        offset -= node.begin
    leaf: Leaf[Row] = node  # type: ignore[assignment]  # a node that is not a branch is a leaf
    row, first = leaf.row, leaf.first
    starts = row.starts
    place = bisect_right(starts, t - offset, first, leaf.last) - 1
    place = place if place > first else first
    start = starts[place]
    since = t - (offset + start)  # the sum is exact, so `since` has the same bits for any offset
    if since < 0.0:
        return row, place, 0.0
    duration = row.finishes[place] - start
    return row, place, since if since < duration else duration


def index_at(held: OffsetNode[R], t: float) -> int:
    """Return the index of the last segment that begins by time t [s]; 0 before the first."""
    return max(count_by(held, t) - 1, 0)


def item(held: OffsetNode[R], index: int) -> Any:
    """Return the segment or the event with an index, 0 <= index < count, with its times on this rope."""
    offset, node = held
    while node.__class__ is Branch:  # not isinstance, since this is a frequent query
        place = bisect_right(node.counts, index) - 1
        index -= node.counts[place]
        child = node.nodes[place]
        offset += node.begins[place] - child.begin
        node = child
    leaf: Leaf[R] = node  # type: ignore[assignment]  # a node that is not a branch is a leaf
    return leaf.row[leaf.first + index].shift_by(offset)


def leaves(held: OffsetNode[R], first: float, last: float) -> Iterator[tuple[float, Leaf[R]]]:
    """Yield the leaves that are active at some time from `first` to `last` [s], in order, each with the offset of its
    times [s].
    """
    offset, node = held
    if isinstance(node, Leaf):
        yield offset, node
        return
    low = max(bisect_right(node.begins, first - offset) - 1, 0)
    for child in _children(node, low, max(bisect_right(node.begins, last - offset), low + 1), offset):
        yield from leaves(child, first, last)


def blocks(held: OffsetNode[Row], first: float, last: float) -> Iterator[RowPart]:
    """Yield the blocks that are active at some time from `first` to `last` [s], in order."""
    for offset, leaf in leaves(held, first, last):
        row = leaf.row
        low = bisect_right(row.starts, first - offset, leaf.first + 1, leaf.last) - 1
        high = bisect_right(row.starts, last - offset, low + 1, leaf.last)
        for begin, end in pairwise([low, *range(low - low % BLOCK_LENGTH + BLOCK_LENGTH, high, BLOCK_LENGTH), high]):
            yield RowPart(offset, row, begin, end)


def segments(held: OffsetNode[Row]) -> Iterator[Segment]:
    """Yield all segments with their times on this rope."""
    for offset, leaf in leaves(held, -inf, inf):
        yield from _shift_rows(leaf.row.between(leaf.first, leaf.last), offset)


# --- events ------------------------------------------------------------------------------------------------------


def events(held: OffsetNode[EventRow], first: int, last: int) -> Iterator[Event]:
    """Yield the events from index `first` up to, but not including, `last`, with their times on this rope."""
    for before, offset, leaf in parts(held, first) if first < last else ():
        if before >= last:
            return
        low, high = max(first - before, 0), min(last - before, leaf.count)
        yield from _shift_rows(leaf.row.between(leaf.first + low, leaf.first + high), offset)


def count_by(held: OffsetNode[R], t: float, *, before: bool = False) -> int:
    """Return how many events happen, or segments begin, up to time t [s], or (`before`) earlier than t."""
    cut = bisect_left if before else bisect_right
    offset, node = held
    gone = 0
    while node.__class__ is Branch:  # not isinstance, since this is a frequent query
        place = max(cut(node.begins, t - offset) - 1, 0)
        gone += node.counts[place]
        child = node.nodes[place]
        offset += node.begins[place] - child.begin
        node = child
    leaf: Leaf[R] = node  # type: ignore[assignment]  # a node that is not a branch is a leaf
    return gone + cut(leaf.row.starts, t - offset, leaf.first, leaf.last) - leaf.first


def value_at(held: OffsetNode[EventRow], channel: int, t: float) -> float | None:
    """Return the value of a channel at time t [s]; None if no event has changed it by then."""
    offset, node = held
    t -= offset
    ancestors: list[tuple[Branch[EventRow], int]] = []
    while node.__class__ is Branch:  # not isinstance, for speed: g calls this to read the state of the hand
        place = bisect_right(node.begins, t) - 1
        if place < 0:
            break
        ancestors.append((node, place))
        begin, node = node.begins[place], node.nodes[place]
        t += node.begin - begin  # exact, because all times are on the grid
    if node.__class__ is Leaf:
        row = node.row
        places = row.places(channel)
        if places:
            first = node.first
            i = bisect_left(places, bisect_right(row.starts, t, first, node.last)) - 1
            if i >= 0 and places[i] >= first:
                return row.values[places[i]]
    for branch, place in reversed(ancestors):
        found = (branch.changes or _changes(branch)).get(channel)
        if found is not None:
            i = bisect_left(found.places, place) - 1
            if i >= 0:
                return found.values[i]
    return None


def _changes(branch: Branch[EventRow]) -> dict[int, ChannelChanges]:
    """Find which children of a branch change each channel, and the value of the channel after each."""
    found: dict[int, ChannelChanges] = {}
    for place, child in enumerate(branch.nodes):
        for channel, value in last_values(child).items():
            changes = found.setdefault(channel, ChannelChanges(array("i"), array("d")))
            changes.places.append(place)
            changes.values.append(value)
    branch.changes = found
    return found


def last_values(node: Node[EventRow]) -> dict[int, float]:
    """Return, for each channel that the events of a node change, its value after the last event."""
    if isinstance(node, Branch):
        return {channel: change.values[-1] for channel, change in (node.changes or _changes(node)).items()}
    if node.values is None:
        node.values = {}
        for channel in node.row.changed_channels():
            places = node.row.places(channel)
            i = bisect_left(places, node.last) - 1
            if i >= 0 and places[i] >= node.first:
                node.values[channel] = node.row.values[places[i]]
    return node.values


def changes(held: OffsetNode[EventRow], channel: int) -> Iterator[tuple[float, float]]:
    """Yield the time [s] and the new value of each change of a channel."""
    for _, offset, leaf in parts(held):
        row, places = leaf.row, leaf.row.places(channel)
        for place in places[bisect_left(places, leaf.first) : bisect_left(places, leaf.last)]:
            yield offset + row.starts[place], row.values[place]
