"""Tests of ropes against lists: splicing, shifting, reading."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from random import Random
from threading import Thread

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.examples import examples
from vrs_cli.trajectory import rope
from vrs_cli.trajectory.instant import TICK
from vrs_cli.trajectory.rope import BLOCK_LENGTH, MAX_CHILDREN, SMALL_LEAF, Branch, Leaf, OffsetNode
from vrs_cli.trajectory.row import Row
from vrs_cli.trajectory.segment import JointPath, Phase, Segment
from vrs_cli.values.commands import Motion, MotionKind, Start

MOTION = Motion(1, MotionKind.JOINT, Start.AFTER)


def segment(start: float, length: float = 1.0) -> Segment:
    return Segment(start, start + length, JointPath(((start, 1.0),)), Phase.CRUISE, MOTION)


def row(count: int, start: float = 0.0) -> list[Segment]:
    return [segment(start + k) for k in range(count)]


def listed(held: OffsetNode | None) -> list[Segment]:
    return [] if held is None else list(rope.segments(held))


def check_sound(held: OffsetNode) -> None:
    """Check that counts, begins, ends and heights fit the children."""
    node = held.node
    if isinstance(node, Leaf):
        assert 1 <= node.count == len(node.row[node.first : node.last]) == node.last - node.first
        assert list(node.row.starts) == [one.start for one in node.row]
        assert (node.begin, node.end) == (node.row[node.first].start, node.row[node.last - 1].finish)
        return
    children = [OffsetNode(begin - child.begin, child) for begin, child in zip(node.begins, node.nodes, strict=True)]
    assert 1 <= len(children) <= MAX_CHILDREN
    sizes = [child.node.count for child in children]
    assert list(node.counts) == [sum(sizes[:k]) for k in range(len(sizes) + 1)]
    assert (node.count, node.begin) == (node.counts[-1], node.begins[0])
    assert node.end == children[-1].offset + children[-1].node.end
    for child in children:
        assert child.node.height == node.height - 1
        check_sound(child)


def cut_up(pieces: int, length: int = SMALL_LEAF) -> OffsetNode:
    """Make a rope of leaves of this length, all of one row."""
    held = rope.rope_of(Row(row(pieces * length)))
    assert held is not None
    for piece in range(1, pieces):
        again = rope.splice(held, piece * length, piece * length, (), 1.0)  # a shift cuts
        assert again is not None
        held = again
    return held


@pytest.mark.parametrize("count", [1, 2, 1000])
def test_made_of_a_list(count: int) -> None:
    held = rope.rope_of(Row(row(count)))
    assert held is not None
    check_sound(held)
    assert held.node.count == count
    assert rope.item(held, count - 1) == segment(count - 1.0)


def test_of_nothing() -> None:
    assert rope.rope_of(Row()) is None


@examples(80)
@given(st.integers(0, 2**32 - 1))
def test_splices_as_of_a_list(seed: int) -> None:
    """Edit trees of one to three levels as a timeline does, and a list in the same way."""
    source = Random(seed)
    held: OffsetNode | None = cut_up(
        *source.choice([(1, 3), (5, SMALL_LEAF), (MAX_CHILDREN + 3, 40), (MAX_CHILDREN * 3, 8)])
    )
    plain, versions = listed(held), []
    for _ in range(12):
        assert held is not None
        keep = source.choice([0, len(plain), source.randint(0, len(plain))])
        most = source.choice([0, 3, 2 * SMALL_LEAF, len(plain)])
        drop = source.randint(0, min(most, len(plain) - keep))
        begin = plain[keep - 1].finish if keep else plain[0].start
        new = row(source.choice([0, 1, 3, SMALL_LEAF + 2, 3 * SMALL_LEAF]), begin)
        shift = source.choice([0.0, float(len(new) + source.randint(0, 9))])
        versions.append((held, plain))
        held = rope.splice(held, keep, keep + drop, new, shift)
        plain = plain[:keep] + new + [s.shift_by(shift) for s in plain[keep + drop :]]
        assert listed(held) == plain
        if held is None or source.random() < 0.2:  # go on from an old one: two versions have the same row then
            held, plain = source.choice(versions)
        check_sound(held)
        for index in {0, len(plain) - 1, source.randrange(len(plain))}:
            assert rope.item(held, index) == plain[index]
        if all(a.finish <= b.start for a, b in pairwise(plain)):
            for t in (source.uniform(-5.0, plain[-1].finish + 5.0) for _ in range(20)):
                found = [k for k, s in enumerate(plain) if s.start <= t]
                assert rope.index_at(held, t) == (found[-1] if found else 0)
    for before, whole in versions:
        assert listed(before) == whole, "whoever reads an old one is not disturbed"


def test_edits_copy_only_what_lies_along_their_way() -> None:
    held = cut_up(MAX_CHILDREN * 2)
    again = rope.splice(held, SMALL_LEAF * 40 + 7, SMALL_LEAF * 40 + 9, row(3, SMALL_LEAF * 40 + 46.0), 1.0)
    assert again is not None
    old = {id(leaf) for _, leaf in rope.leaves(held, 0.0, 1e9)}
    new = {id(leaf) for _, leaf in rope.leaves(again, 0.0, 1e9)}
    assert len(new - old) <= 3
    assert {id(leaf.row) for _, leaf in rope.leaves(held, 0.0, 1e9)} == {id(held_row(held))}
    assert isinstance(again.node, Branch)


def held_row(held: OffsetNode) -> rope.Row:
    return next(rope.leaves(held, 0.0, 0.0))[1].row


def test_many_edits_leave_no_crumbs() -> None:
    """Leaves hold at least a sixth of a small leaf on average, and the tree is no higher than that needs."""
    source, held = Random(5), rope.rope_of(Row(row(50 * SMALL_LEAF)))
    for _ in range(3000):
        assert held is not None
        keep = source.randrange(1, held.node.count - 6)
        new = [rope.item(held, keep + k) for k in range(source.choice([0, 1, 2, 4]))]
        held = rope.splice(held, keep, keep + 2, new, source.choice([0.0, 2 * TICK]))
    assert held is not None
    check_sound(held)
    sizes = [leaf.count for _, leaf in rope.leaves(held, -1e9, 1e9)]
    assert 6 * sum(sizes) >= SMALL_LEAF * len(sizes)
    assert held.node.height <= 2


def test_what_is_put_on_behind_lengthens_the_row() -> None:
    held = rope.rope_of(Row(row(3)))
    for k in range(1000):
        assert held is not None
        held = rope.splice(held, held.node.count, held.node.count, row(3, 3.0 * k + 3.0), 0.0)
    assert held is not None
    assert len(list(rope.leaves(held, -1.0, 1e9))) == 1
    assert listed(held) == row(3003)


def test_two_versions_that_go_on_from_one_do_not_disturb_each_other() -> None:
    held = rope.rope_of(Row(row(3)))
    assert held is not None
    one, other = (rope.splice(held, 3, 3, row(2, begin), 0.0) for begin in (3.0, 7.0))
    assert listed(held) == row(3)
    assert listed(one) == row(5)
    assert listed(other) == row(3) + row(2, 7.0)


def test_threads_that_go_on_from_one_version_do_not_disturb_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both threads find the end of the row free; the other one enters just before this one takes it."""
    held, grow, made = rope.rope_of(Row(row(3))), Row.grow, list[OffsetNode | None]()
    assert held is not None
    other = Thread(target=lambda: made.append(rope.splice(held, 3, 3, row(2, 7.0), 0.0)))

    def let_in(self: Row, segments: Sequence[Segment]) -> None:
        monkeypatch.setattr(Row, "grow", grow)
        other.start()
        other.join(0.1)
        grow(self, segments)

    monkeypatch.setattr(Row, "grow", let_in)
    one = rope.splice(held, 3, 3, row(2, 3.0), 0.0)
    other.join()
    assert listed(held) == row(3)
    assert listed(one) == row(5)
    assert listed(made[0]) == row(3) + row(2, 7.0)


def test_an_edit_that_is_interrupted_leaves_no_trace() -> None:
    """Ctrl-C may come between any two steps."""

    class Interrupted(list[Motion]):
        def extend(self, _motions: object) -> None:
            raise KeyboardInterrupt

    held = rope.rope_of(Row(row(3)))
    assert held is not None
    one = held_row(held)
    one.motions = Interrupted(one.motions)
    with pytest.raises(KeyboardInterrupt):
        rope.splice(held, 3, 3, row(2, 7.0), 0.0)
    one.motions = list(one.motions)
    again = rope.splice(held, 3, 3, row(3, 3.0), 0.0)
    assert again is not None
    check_sound(again)
    assert listed(again) == row(6)


def test_a_stream_that_takes_back_its_last_segments_makes_long_rows() -> None:
    """As in steering, what is planned ahead is dropped and planned again, over and over."""
    held = rope.rope_of(Row(row(1)))
    for _ in range(20 * SMALL_LEAF):
        assert held is not None
        keep = max(held.node.count - 3, 1)
        begin = rope.item(held, keep - 1).finish
        held = rope.splice(held, keep, held.node.count, row(4, begin), 0.0)
    assert held is not None
    check_sound(held)
    assert listed(held) == row(held.node.count)
    assert len(list(rope.leaves(held, -1.0, 1e9))) <= 3


def test_leaves_of_a_stretch_of_time() -> None:
    found = list(rope.leaves(cut_up(10, 100), 250.0, 455.0))  # the shifts make each leaf begin one second later
    assert [offset + leaf.begin for offset, leaf in found] == [202.0, 303.0, 404.0]


def test_blocks_of_a_stretch_of_time() -> None:
    """Blocks are parts of rows that do not cross a multiple of BLOCK_LENGTH, from the segment in force at the
    beginning.
    """
    held = rope.rope_of(Row(row(4 * BLOCK_LENGTH)))
    assert held is not None
    found = list(rope.blocks(held, BLOCK_LENGTH - 1.5, 2.0 * BLOCK_LENGTH + 3.0))
    assert [(block.first, block.last) for block in found] == [
        (BLOCK_LENGTH - 2, BLOCK_LENGTH),
        (BLOCK_LENGTH, 2 * BLOCK_LENGTH),
        (2 * BLOCK_LENGTH, 2 * BLOCK_LENGTH + 4),
    ]
    assert [block.begin for block in found] == [BLOCK_LENGTH - 2.0, BLOCK_LENGTH, 2.0 * BLOCK_LENGTH]
    (before,) = rope.blocks(held, -5.0, -4.0)
    assert (before.first, before.last) == (0, 1)
