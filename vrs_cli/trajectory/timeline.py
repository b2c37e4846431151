"""The trajectory timeline tau: an immutable, ordered sequence of segments.

Segments stand in blocks; a block has one time offset for all its segments, so an edit copies one or two blocks and
moves the offsets of those after it: the kept tail is neither copied nor computed again. Old versions stay valid for
whoever reads them and share their blocks with new ones.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from vrs_cli.trajectory.block_table import BlockTable
from vrs_cli.trajectory.delta import Cause, TimelineDelta
from vrs_cli.trajectory.segment import Segment

BLOCK = 512  # segments in a full block


@dataclass(frozen=True, slots=True)
class Block:
    """Segments with their stored starts; the time of all is `offset` later than stored.

    `table` holds the same segments as arrays once they were read so (`block_table`); a moved block shares it.
    """

    offset: float
    starts: tuple[float, ...]
    segments: tuple[Segment, ...]
    table: list[BlockTable] = field(default_factory=list, compare=False, repr=False)

    def moved(self, shift: float) -> Block:
        return Block(self.offset + shift, self.starts, self.segments, self.table)

    def part(self, first: int, last: int) -> Block:
        return Block(self.offset, self.starts[first:last], self.segments[first:last])


def _blocks(segments: Iterable[Segment]) -> Iterator[Block]:
    everything = tuple(segments)
    for first in range(0, len(everything), BLOCK):
        part = everything[first : first + BLOCK]
        yield Block(0.0, tuple(segment.start for segment in part), part)


def _joined(left: Block, right: Block) -> Block:
    """One block of two small ones, so that many edits in one place do not leave crumbs."""
    moved = [segment.shifted(right.offset - left.offset) for segment in right.segments]
    return Block(left.offset, left.starts + tuple(segment.start for segment in moved), left.segments + tuple(moved))


class Timeline:
    """tau[k]; `version` is k. The first segment is s_0: the initial pose, of no length, at its start time."""

    __slots__ = ("_begins", "_blocks", "_counts", "version")

    def __init__(self, segments: Iterable[Segment], version: int = 0) -> None:
        self._set(list(_blocks(segments)), version)

    def _set(self, blocks: list[Block], version: int) -> None:
        self.version = version
        self._blocks = blocks
        self._begins = [block.offset + block.starts[0] for block in blocks]
        counts = [0]
        for block in blocks:
            counts.append(counts[-1] + len(block.starts))
        self._counts = counts

    # --- reading ---

    def __len__(self) -> int:
        return self._counts[-1]

    def __getitem__(self, index: int) -> Segment:
        count = len(self)
        if index < 0:
            index += count
        if not 0 <= index < count:
            raise IndexError(index)
        block = bisect_right(self._counts, index) - 1
        return self._blocks[block].segments[index - self._counts[block]].shifted(self._blocks[block].offset)

    def __iter__(self) -> Iterator[Segment]:
        for block in self._blocks:
            for segment in block.segments:
                yield segment.shifted(block.offset)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Timeline) and len(self) == len(other) and all(map(_same, self, other))

    def __hash__(self) -> int:
        return hash((self.version, len(self), self.end))

    @property
    def start(self) -> float:
        """The time of the first segment [s]."""
        return self._begins[0]

    @property
    def end(self) -> float:
        """When the last segment finishes [s]."""
        block = self._blocks[-1]
        return block.offset + block.segments[-1].finish

    @property
    def block_begins(self) -> Sequence[float]:
        """The start of each block's first segment [s]."""
        return self._begins

    def block(self, number: int) -> Block:
        return self._blocks[number]

    def index_at(self, t: float) -> int:
        """The index of the last segment with start <= t (0 before the first)."""
        block = max(bisect_right(self._begins, t) - 1, 0)
        held = self._blocks[block]
        return self._counts[block] + max(bisect_right(held.starts, t - held.offset) - 1, 0)

    def locate(self, t: float) -> tuple[Segment, float]:
        """The segment in force at t as stored, and t - t_s limited to its duration (the robot stands still in gaps)."""
        blocks = self._blocks
        held = blocks[bisect_right(self._begins, t) - 1] if t >= self._begins[0] else blocks[0]
        local = t - held.offset
        segment = held.segments[bisect_right(held.starts, local) - 1 if local >= held.starts[0] else 0]
        since = local - segment.start
        if since < 0.0:
            return segment, 0.0
        duration = segment.finish - segment.start
        return segment, since if since < duration else duration

    # --- changing: a new version ---

    def apply(self, delta: TimelineDelta) -> Timeline:
        """tau[k+1]. Raises ValueError when the delta was made for another version."""
        if delta.version != self.version:
            raise ValueError(f"a delta of version {delta.version} does not fit timeline version {self.version}")
        blocks = self._head(delta)
        blocks += _blocks(delta.segments)
        blocks += self._tail(delta.keep + delta.drop, delta.shift)
        timeline = Timeline.__new__(Timeline)
        timeline._set(_compacted(blocks), self.version + 1)
        return timeline

    def _head(self, delta: TimelineDelta) -> list[Block]:
        """The blocks of the kept segments, the last of them truncated at the cut."""
        block, within = self._place(delta.keep)
        head = self._blocks[:block]
        if within:
            head = [*head, self._blocks[block].part(0, within)]
        if head and head[-1].segments[-1].finish + head[-1].offset > delta.cut:
            last = head[-1]
            cut = last.segments[-1].truncated(delta.cut - last.offset)
            head[-1] = Block(last.offset, last.starts, (*last.segments[:-1], cut))
        return head

    def _tail(self, first: int, shift: float) -> list[Block]:
        """The blocks from segment `first` on, moved by `shift`."""
        block, within = self._place(first)
        tail = self._blocks[block:]
        if within:
            tail = [tail[0].part(within, len(tail[0].starts)), *tail[1:]]
        return [held.moved(shift) for held in tail] if shift else tail

    def _place(self, index: int) -> tuple[int, int]:
        """Block and place within it of a segment index; one past the end is allowed."""
        if index >= len(self):
            return len(self._blocks), 0
        block = bisect_right(self._counts, index) - 1
        return block, index - self._counts[block]

    def inverse(self, delta: TimelineDelta) -> TimelineDelta:
        """The delta that takes `delta` back: self is the timeline before it, the result fits the one after it."""
        kept_whole = delta.keep
        if kept_whole and self[kept_whole - 1].finish > delta.cut:
            kept_whole -= 1  # the truncated segment is given back whole
        return TimelineDelta(
            version=self.version + 1,
            cause=Cause.UNDO,
            motion=delta.motion,
            issued=delta.issued,
            executed=delta.executed,
            cut=self[kept_whole - 1].finish if kept_whole else self.start,
            keep=kept_whole,
            drop=delta.keep - kept_whole + len(delta.segments),
            shift=-delta.shift,
            segments=tuple(self[index] for index in range(kept_whole, delta.keep + delta.drop)),
        )


def _same(a: Segment, b: Segment) -> bool:
    return a == b


def _compacted(blocks: list[Block]) -> list[Block]:
    """Neighbours that fit into one block together become one."""
    result: list[Block] = []
    for block in blocks:
        if result and len(result[-1].starts) + len(block.starts) <= BLOCK // 2:
            result[-1] = _joined(result[-1], block)
        else:
            result.append(block)
    return result
