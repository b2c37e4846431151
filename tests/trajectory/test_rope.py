"""Ropes against lists: splicing, shifting, reading."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vrs_cli.trajectory import rope
from vrs_cli.trajectory.instant import TICK
from vrs_cli.trajectory.motion import Kind, Motion, Start
from vrs_cli.trajectory.rope import FAN, LEAF, Branch, Held, Leaf
from vrs_cli.trajectory.segment import JointPath, Phase, Segment

MOTION = Motion(1, Kind.JOINT, Start.AFTER)


def segment(start: float, length: float = 1.0) -> Segment:
    return Segment(start, start + length, JointPath(((start, 1.0),)), Phase.CRUISE, MOTION)


def row(count: int, start: float = 0.0) -> list[Segment]:
    return [segment(start + k) for k in range(count)]


def listed(held: Held | None) -> list[Segment]:
    return [] if held is None else list(rope.segments(held))


def check_sound(held: Held) -> None:
    """Counts, begins, ends and heights are what the children say."""
    node = held.node
    if isinstance(node, Leaf):
        assert 1 <= node.count == len(node.segments) == node.last - node.first <= LEAF
        assert list(node.starts[node.first : node.last]) == [one.start for one in node.segments]
        assert (node.begin, node.end) == (node.segments[0].start, node.segments[-1].finish)
        return
    children = [Held(offset, child) for offset, child in zip(node.offsets, node.nodes, strict=True)]
    assert 1 <= len(children) <= FAN
    assert list(node.begins) == [child.offset + child.node.begin for child in children]
    sizes = [child.node.count for child in children]
    assert list(node.counts) == [sum(sizes[:k]) for k in range(len(sizes) + 1)]
    assert (node.count, node.begin) == (node.counts[-1], node.begins[0])
    assert node.end == children[-1].offset + children[-1].node.end
    for child in children:
        assert child.node.height == node.height - 1
        check_sound(child)


@pytest.mark.parametrize("count", [1, LEAF, LEAF + 1, LEAF * FAN, LEAF * FAN + 5])
def test_made_of_a_list(count: int) -> None:
    held = rope.rope_of(row(count))
    assert held is not None
    check_sound(held)
    assert held.node.count == count
    assert rope.segment(held, count - 1) == segment(count - 1.0)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(st.integers(0, 2**32 - 1))
def test_splices_as_of_a_list(seed: int) -> None:
    """Edits as a timeline makes them, on trees of one to three levels, beside the same edits of a list."""
    source = Random(seed)
    count = source.choice([3, LEAF, 5 * LEAF, FAN * LEAF + 3 * LEAF])
    held, plain = rope.rope_of(row(count)), row(count)
    for _ in range(10):
        assert held is not None
        keep = source.choice([0, len(plain), source.randint(0, len(plain))])
        most = source.choice([0, 3, 2 * LEAF, len(plain)])
        drop = source.randint(0, min(most, len(plain) - keep))
        begin = plain[keep - 1].finish if keep else plain[0].start
        new = row(source.choice([0, 1, 3, LEAF + 2, 3 * LEAF]), begin)
        shift = source.choice([0.0, float(len(new) + source.randint(0, 9))])
        before, whole = held, list(plain)
        held = rope.spliced(held, keep, keep + drop, new, shift)
        plain = plain[:keep] + new + [s.shifted(shift) for s in plain[keep + drop :]]
        assert listed(held) == plain
        assert listed(before) == whole, "whoever reads the old one is not disturbed"
        if held is None:
            return
        check_sound(held)
        for index in {0, len(plain) - 1, source.randrange(len(plain))}:
            assert rope.segment(held, index) == plain[index]
        if all(a.finish <= b.start for a, b in pairwise(plain)):
            for t in (source.uniform(-5.0, plain[-1].finish + 5.0) for _ in range(20)):
                found = [k for k, s in enumerate(plain) if s.start <= t]
                assert rope.index_at(held, t) == (found[-1] if found else 0)


def test_edits_copy_only_what_lies_along_their_way() -> None:
    held = rope.rope_of(row(FAN * LEAF * 2))
    assert held is not None
    again = rope.spliced(held, LEAF * 40 + 7, LEAF * 40 + 9, row(3, LEAF * 40 + 7.0), 1.0)
    assert again is not None
    old = {id(leaf.node) for leaf in rope.leaves(held, 0.0, 1e9)}
    new = {id(leaf.node) for leaf in rope.leaves(again, 0.0, 1e9)}
    assert len(new - old) <= 3
    assert isinstance(again.node, Branch)


def test_many_edits_leave_no_crumbs() -> None:
    """Leaves are a sixth full on the average, and the tree is no higher than it must be for that."""
    source, held = Random(5), rope.rope_of(row(50 * LEAF))
    for _ in range(3000):
        assert held is not None
        keep = source.randrange(1, held.node.count - 6)
        new = [rope.segment(held, keep + k) for k in range(source.choice([0, 1, 2, 4]))]
        held = rope.spliced(held, keep, keep + 2, new, source.choice([0.0, 2 * TICK]))
    assert held is not None
    check_sound(held)
    sizes = [leaf.node.count for leaf in rope.leaves(held, -1e9, 1e9)]
    assert 6 * sum(sizes) >= LEAF * len(sizes)
    assert held.node.height <= 2


def test_leaves_of_a_stretch_of_time() -> None:
    held = rope.rope_of(row(LEAF * 10))
    assert held is not None
    found = list(rope.leaves(held, LEAF * 2.5, LEAF * 4.5))
    assert [leaf.offset + leaf.node.begin for leaf in found] == [LEAF * 2.0, LEAF * 3.0, LEAF * 4.0]
