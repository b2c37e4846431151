"""Rows of segments as columns: what is read of them is what was put in, however old it is."""

from __future__ import annotations

import pytest

from vrs_cli.trajectory.row import YOUNG, Row
from vrs_cli.trajectory.segment import JointPath, Phase, Segment
from vrs_cli.values.commands import Motion, MotionKind, Start

MOTIONS = [Motion(number, MotionKind.JOINT, Start.AFTER) for number in range(3)]
PATHS = [((0.1, -0.0), (2.0, 3.0)), ((0.1, 0.2, 0.3), (1.0, -0.0, 2.0)), ((0.5,), (0.25,)), ((1.0, 2.0, 3.0, 4.0),) * 2]


def segments(count: int) -> list[Segment]:
    return [
        Segment(float(k), k + 0.5, JointPath(PATHS[k % 4]), [Phase.REST, Phase.CRUISE][k % 2], MOTIONS[k % 3])
        for k in range(count)
    ]


def test_gives_what_was_put_in() -> None:
    some = segments(4 * YOUNG)
    row = Row(some[:5])
    row.grow(some[5:])
    assert repr(list(row)) == repr(segments(4 * YOUNG))  # to the sign of a zero
    assert list(row) == some
    assert row[-1] == some[-1]
    assert row[7:9] == some[7:9]
    assert all(a.motion is b.motion for a, b in zip(row, some, strict=True))


def test_what_is_far_from_the_end_is_shared_and_small() -> None:
    some = segments(4 * YOUNG)
    row = Row(some)
    assert row.paths[0] is some[0].path
    assert isinstance(row.paths[0], JointPath)
    assert isinstance(row.paths[0]._rows, bytes)
    assert isinstance(row.paths[-1], JointPath)
    assert row.paths[-1]._rows is PATHS[-1]


def test_a_path_is_packed_once_however_a_row_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    row, packed = Row(), list[JointPath]()

    def pack(path: JointPath) -> None:
        packed.append(path)

    monkeypatch.setattr(JointPath, "pack", pack)
    for segment in segments(8 * YOUNG):
        row.grow([segment])
    assert 6 * YOUNG <= len(packed) == len({id(path) for path in packed})


def test_takes_a_part_of_another_row_later() -> None:
    row, other = Row(segments(2)), Row(segments(9))
    row.take(other, 4, 6, 10.0)
    assert list(row) == [*segments(2), *(one.shifted(10.0) for one in segments(9)[4:6])]


def test_a_packed_path_is_the_same() -> None:
    eight = tuple([(0.1 * k, 0.2, -0.3) for k in range(8)])
    for rows in (*PATHS, eight, eight[:6], tuple([a[:2] for a in eight[:6]])):
        path, kept = JointPath(rows), JointPath(rows)
        path.pack()
        path.pack()
        assert path == kept
        assert not path != kept  # noqa: SIM202 (both are asked)
        assert not path == JointPath((*rows[1:], (9.0,)))  # noqa: SIM201
        assert hash(path) == hash(kept)
        assert repr(path) == repr(kept)
        assert path.coefficients == rows
        for s in (0.0, 0.125, 0.7):
            assert path.joints(s) == kept.joints(s)
    assert JointPath(((0.0,),)) == JointPath(((-0.0,),))
