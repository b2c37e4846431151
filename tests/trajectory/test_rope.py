"""Ropes against lists: cutting, joining, shifting, reading."""

from __future__ import annotations

from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vrs_cli.trajectory import rope
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
        assert 1 <= node.count == len(node.segments) == len(node.starts) <= LEAF
        assert (node.begin, node.end) == (node.starts[0], node.segments[-1].finish)
        return
    assert 1 <= len(node.children) <= FAN
    assert node.begins == tuple(child.offset + child.node.begin for child in node.children)
    sizes = [child.node.count for child in node.children]
    assert node.counts == tuple(sum(sizes[:k]) for k in range(len(sizes) + 1))
    assert (node.count, node.begin) == (node.counts[-1], node.begins[0])
    assert node.end == node.children[-1].offset + node.children[-1].node.end
    for child in node.children:
        assert child.node.height == node.height - 1
        check_sound(child)


@pytest.mark.parametrize("count", [1, LEAF, LEAF + 1, LEAF * FAN, LEAF * FAN + 5])
def test_made_of_a_list(count: int) -> None:
    held = rope.rope_of(row(count))
    assert held is not None
    check_sound(held)
    assert held.node.count == count
    assert rope.segment(held, count - 1) == segment(count - 1.0)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_cut_join_and_shift_as_lists(seed: int) -> None:
    """Edits as a timeline makes them, on a tree of three levels, beside the same edits of a list."""
    source = Random(seed)
    count = source.choice([3, LEAF, 5 * LEAF, FAN * LEAF + 3 * LEAF])
    held, plain = rope.rope_of(row(count)), row(count)
    for _ in range(8):
        keep = source.randint(0, len(plain))
        drop = source.randint(0, min(3, len(plain) - keep))
        begin = plain[keep - 1].finish if keep else 0.0
        new = row(source.choice([0, 1, 3, LEAF + 2]), begin)
        shift = float(len(new) + source.randint(0, 9))
        head, others = rope.cut(held, keep)
        _, tail = rope.cut(others, drop)
        held = rope.joined(rope.joined(head, rope.rope_of(new)), tail and tail.shifted(shift))
        plain = plain[:keep] + new + [s.shifted(shift) for s in plain[keep + drop :]]
        assert listed(held) == plain
        if held is None:
            return
        check_sound(held)
        for t in (source.uniform(-5.0, plain[-1].finish + 5.0) for _ in range(20)):
            before = [k for k, s in enumerate(plain) if s.start <= t]
            assert rope.index_at(held, t) == (before[-1] if before else 0)


def test_edits_copy_only_what_lies_along_the_cut() -> None:
    held = rope.rope_of(row(FAN * LEAF * 2))
    left, right = rope.cut(held, LEAF * 70 + 7)
    again = rope.joined(left, right)
    assert held is not None
    assert again is not None
    old = {id(leaf.node) for leaf in rope.leaves(held, 0.0, 1e9)}
    new = {id(leaf.node) for leaf in rope.leaves(again, 0.0, 1e9)}
    assert len(new - old) <= 2
    assert isinstance(again.node, Branch)


def test_leaves_of_a_stretch_of_time() -> None:
    held = rope.rope_of(row(LEAF * 10))
    assert held is not None
    found = list(rope.leaves(held, LEAF * 2.5, LEAF * 4.5))
    assert [leaf.offset + leaf.node.begin for leaf in found] == [LEAF * 2.0, LEAF * 3.0, LEAF * 4.0]
