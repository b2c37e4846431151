from __future__ import annotations

import csv
import io
import json
import struct
import tracemalloc
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from itertools import pairwise
from math import degrees, radians
from pathlib import Path
from random import Random
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from msgspec import structs

import vrs_cli as vrs
from tests.examples import some
from tests.files.joint_trajectory import Point, sampled, time_of
from tests.files.trajectories import initial, planned, puma
from tests.interfaces.terminals import RecordingTerminal
from tests.world.cells import BOX, TABLE, Arm
from vrs_cli.engine.position import joints_over, position_at
from vrs_cli.errors import FileError, VrsError
from vrs_cli.files.cell_file import parse_cell
from vrs_cli.files.exports import EXPORTERS, export, write_csv
from vrs_cli.files.samples import CHUNK, SAMPLES_PER_CHUNK, sample_times
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import from_oat, position, to_oat
from vrs_cli.trajectory.segment import CartesianPath
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import HAND, Event
from vrs_cli.world.course import World

ARM = arm_for(puma())


def rows_of(timeline: Timeline, rate: float) -> list[list[str]]:
    stream = io.BytesIO()
    write_csv(stream, ARM, timeline, rate)
    return list(csv.reader(io.StringIO(stream.getvalue().decode("ascii"))))


def test_the_columns_are_fixed() -> None:
    assert ",".join(rows_of(Timeline([initial()]), 10.0)[0]) == "t,jt1,jt2,jt3,jt4,jt5,jt6,x,y,z,o,a,t_angle"


def test_every_row_is_what_g_says_at_its_time() -> None:
    timeline, _ = planned(15)
    for row in rows_of(timeline, 13.0)[1:]:
        t, *numbers = map(float, row)
        position = position_at(ARM, timeline, t)
        T = position.T_world_tool
        expected = [degrees(q) for q in position.joints]
        expected += [1000.0 * x for x in (T.px, T.py, T.pz)]
        expected += [degrees(angle) for angle in to_oat(T)]
        assert numbers == pytest.approx(expected, abs=1e-9, rel=0.0)


def test_rows_go_from_the_start_by_one_period_to_the_exact_end() -> None:
    timeline, _ = planned(8)
    times = [float(row[0]) for row in rows_of(timeline, 50.0)[1:]]
    assert times[0] == timeline.start
    assert times[-1] == timeline.end
    assert times[:-1] == [k / 50.0 for k in range(len(times) - 1)]
    assert times[-2] < times[-1] <= times[-2] + 1 / 50.0


def test_a_robot_that_never_moved_is_one_row() -> None:
    assert len(rows_of(Timeline([initial()]), 100.0)) == 2


def test_chunks_join_without_seam() -> None:
    timeline, _ = planned(3)
    rate = 3.5 * CHUNK / timeline.end
    times = [t for chunk in sample_times(timeline, rate) for t in chunk.tolist()]
    assert max(len(chunk) for chunk in sample_times(timeline, rate)) <= CHUNK
    assert times[:-1] == [k / rate for k in range(len(times) - 1)]


def test_the_same_bytes_every_time() -> None:
    timeline, _ = planned(5)
    assert rows_of(timeline, 77.0) == rows_of(timeline, 77.0)


def test_there_is_no_minus_zero() -> None:
    timeline, _ = planned(15)
    assert not [cell for row in rows_of(timeline, 100.0) for cell in row if cell == "-0.000000000"]


# --- NumPy --------------------------------------------------------------------------------------------------


def npz_of(timeline: Timeline, rate: float) -> dict[str, np.ndarray]:
    stream = io.BytesIO()
    EXPORTERS["npz"].write(stream, ARM, timeline, rate)
    stream.seek(0)
    with np.load(stream, allow_pickle=False) as arrays:
        return dict(arrays)


def test_arrays_are_what_g_says_at_their_times() -> None:
    timeline, _ = planned(15)
    arrays = npz_of(timeline, 13.0)
    times = np.concatenate(list(sample_times(timeline, 13.0)))
    assert (arrays["times"] == times).all()
    for row, t in enumerate(times):
        position = position_at(ARM, timeline, t)
        T = position.T_world_tool
        for name, expected in (
            ("joints", position.joints),
            ("velocities", position.velocity),
            ("accelerations", position.acceleration),
            ("xyz", (T.px, T.py, T.pz)),
            ("oat", to_oat(T)),
            ("hand", position.hand),
        ):
            assert arrays[name][row] == pytest.approx(expected, abs=1e-9, rel=1e-9), name


def test_the_archive_is_the_bytes_of_savez() -> None:
    timeline, _ = planned(6)
    stream, again = io.BytesIO(), io.BytesIO()
    EXPORTERS["npz"].write(stream, ARM, timeline, 2.5 * CHUNK / timeline.end)
    stream.seek(0)
    with np.load(stream, allow_pickle=False) as arrays:
        np.savez(again, allow_pickle=False, **arrays)
    assert stream.getvalue() == again.getvalue()


def test_samples_are_not_all_in_memory(tmp_path: Path) -> None:
    timeline, samples = Timeline([structs.replace(initial(), finish=100.0)]), 100_000
    tracemalloc.start()
    try:
        with (tmp_path / "long.npz").open("wb") as stream:
            EXPORTERS["npz"].write(stream, ARM, timeline, samples / timeline.end)
            size = stream.tell()
        assert tracemalloc.get_traced_memory()[1] < size / 2
    finally:
        tracemalloc.stop()


def test_the_segments_are_there_with_their_polynomials() -> None:
    timeline, _ = planned(15)
    arrays = npz_of(timeline, 1.0)
    count = len(timeline)
    assert {len(array) for name, array in arrays.items() if name.startswith("segment")} == {count}
    assert arrays["segment_joints"].shape[:2] == (count, 6)
    for row, segment in enumerate(timeline):
        assert (arrays["segment_start"][row], arrays["segment_finish"][row]) == (segment.start, segment.finish)
        assert arrays["segment_phase"][row] == segment.phase.value
        assert (arrays["segment_command"][row], arrays["segment_text"][row]) == (
            segment.motion.number,
            segment.motion.text,
        )
        straight = isinstance(segment.path, CartesianPath)
        assert arrays["segment_straight"][row] == straight
        ours, other = arrays["segment_xyz" if straight else "segment_joints"][row], "xyz" if not straight else "joints"
        assert np.isnan(arrays[f"segment_{other}"][row]).all()
        polynomials = segment.path.position if straight else segment.path.coefficients
        for got, a in zip(ours, polynomials, strict=True):
            assert tuple(got[: len(a)]) == a
            assert not got[len(a) :].any()


# --- ROS 2 ---------------------------------------------------------------------------------------------------


def ros(arm: RobotArm, timeline: Timeline, rate: float) -> list[Point]:
    stream = io.BytesIO()
    EXPORTERS["ros"].write(stream, arm, timeline, rate)
    told = json.loads(stream.getvalue())
    assert set(told) == {"header", "joint_names", "points"}
    assert told["joint_names"] == [f"jt{i}" for i in range(1, arm.model.joint_count + 1)]
    points: list[Point] = told["points"]
    return points


def test_a_joint_trajectory_has_every_boundary_and_every_sample() -> None:
    timeline, _ = planned(12)
    points = ros(ARM, timeline, 9.0)
    ns = [round(time_of(point) * 1e9) for point in points]
    assert all(0 <= point["time_from_start"]["nanosec"] < 10**9 for point in points)
    assert all(a < b for a, b in pairwise(ns))
    edges = {edge for s in timeline for edge in (s.start, s.finish)}
    samples = {t for times in sample_times(timeline, 9.0) for t in times.tolist()}
    assert set(ns) >= {round((t - timeline.start) * 10**9) for t in edges | samples}
    for point in points:
        position = position_at(ARM, timeline, timeline.start + time_of(point))
        assert point["positions"] == pytest.approx(position.joints, abs=1e-8)
        assert point["velocities"] == pytest.approx(position.velocity, abs=1e-6, rel=1e-6)


def moved(profile: str, seed: int, *, robot: str = "puma560", lines: bool) -> Session:
    """A robot that was sent to random places; some motions round the corners between them."""
    random, session = Random(seed), Session(RecordingTerminal(), load_robot(robot))
    model = session.engine.model
    for _ in range(6):
        session.perform(f"PARAMETER PROFILE = {random.choice(profile.split())}")
        session.perform(f"SPEED {random.uniform(10.0, 100.0)}")
        if random.random() < 0.3:
            session.perform("BREAK")
        joints = (random.uniform(0.7 * low, 0.7 * high) for low, high in zip(model.lower, model.upper, strict=True))
        place = ", ".join(map(str, model.units.to_display(tuple(joints))))
        shift = ", ".join(str(random.uniform(-250.0, 250.0)) for _ in range(3))
        with suppress(VrsError):  # many lines lead out of reach
            line = lines and random.random() < 0.75
            session.perform(f"DO MOVES SHIFT(HERE BY {shift})" if line else f"DO MOVE #PPOINT({place})")
    return session


MIXED = "LSPB SCURVE QUINTIC"


@pytest.mark.parametrize("rate", [0.0, 1.0])
@pytest.mark.parametrize("lines", [False, True])
@pytest.mark.parametrize("profile", ["LSPB", "SCURVE", "QUINTIC", MIXED])
def test_a_controller_interpolates_our_motions(profile: str, lines: bool, rate: float) -> None:
    """Joint motions but for the nanoseconds of ROS: 4 rad/s of the fastest joint in half of one are 1e-7 deg. A quintic
    that begins out of a motion of another profile has a jump of acceleration at its beginning, and points inside.
    """
    for seed in range(some(13)):
        engine = moved(profile, seed, lines=lines).engine
        timeline = engine.timeline
        points = ros(engine.arm, timeline, rate)
        times = np.arange(0.0, timeline.end - timeline.start, 0.0037)
        off = np.abs(sampled(points, times) - joints_over(engine.arm, timeline, timeline.start + times))
        assert degrees(off.max()) < (2e-6 if lines or profile == MIXED else 2e-7)
        if not lines and not rate and profile == "LSPB":  # nothing between the boundaries
            edges = {round(edge * 1e9) for s in timeline for edge in (s.start, s.finish)}
            assert {round(time_of(point) * 1e9) for point in points} == edges
        stamps = [timeline.start + time_of(point) for point in points]
        for a, b in pairwise(stamps):
            if isinstance(timeline.locate(0.5 * (a + b))[0].path, CartesianPath):
                assert b - a < 0.02 + 1e-8


def test_many_points_stand_there_once() -> None:
    timeline, _ = planned(4)
    stamps = [time_of(point) for point in ros(ARM, timeline, 2.5 * CHUNK / (timeline.end - timeline.start))]
    assert len(stamps) > 2 * CHUNK
    assert all(a < b for a, b in pairwise(stamps))


@pytest.mark.parametrize("robot", ["cobra600", "iiwa14", "ur5e"])
def test_a_controller_interpolates_lines_of_other_arms(robot: str) -> None:
    engine = moved("LSPB", 0, robot=robot, lines=True).engine
    times = np.arange(0.0, engine.timeline.end, 0.0037)
    off = np.abs(
        sampled(ros(engine.arm, engine.timeline, 0.0), times) - joints_over(engine.arm, engine.timeline, times)
    )
    assert degrees(off.max()) < 2e-6


@pytest.mark.parametrize("profile", ["LSPB", "SCURVE", "QUINTIC"])
def test_accelerations_are_told_where_they_are_continuous(profile: str) -> None:
    engine = moved(profile, 1, lines=True).engine
    told = set()
    for point in ros(engine.arm, engine.timeline, 0.0):
        t, d = engine.timeline.start + time_of(point), 1e-6
        before, at, after = (position_at(engine.arm, engine.timeline, t + s * d) for s in (-1, 0, 1))
        jump = max(abs(x - y) for x, y in zip(before.acceleration, after.acceleration, strict=True))
        if jump > 0.1:
            assert point["accelerations"] == []
        elif point["accelerations"]:
            assert point["accelerations"] == pytest.approx(at.acceleration, abs=0.02, rel=1e-3)
        told.add(bool(point["accelerations"]))
    assert told == ({True} if profile != "LSPB" else {True, False})


def test_a_robot_that_never_moved_is_one_point() -> None:
    (point,) = ros(ARM, Timeline([initial()]), 9.0)
    assert point["accelerations"] == [0.0] * 6


# --- MCAP ----------------------------------------------------------------------------------------------------


def test_a_log_is_read_back_by_a_reader_of_ros() -> None:
    reader = pytest.importorskip("mcap_ros2.reader")
    timeline, _ = planned(10)
    stream = io.BytesIO()
    EXPORTERS["mcap"].write(stream, ARM, timeline, 20.0)
    stream.seek(0)
    found: dict[str, list] = {"/joint_states": [], "/tool": [], "/tf": [], "/commands": []}
    clock = 0
    for message in reader.read_ros2_messages(stream):
        assert message.log_time_ns >= clock
        clock = message.log_time_ns
        found[message.channel.topic].append((message.log_time_ns, message.ros_msg))
    times = np.concatenate(list(sample_times(timeline, 20.0)))
    assert len(found["/joint_states"]) == len(found["/tool"]) == len(found["/tf"]) == len(times)
    for t, (ns, state), (_, tool) in zip(times, found["/joint_states"], found["/tool"], strict=True):
        position = position_at(ARM, timeline, t)
        assert ns == round(t * 1e9) == state.header.stamp.sec * 10**9 + state.header.stamp.nanosec
        assert state.name == ["jt1", "jt2", "jt3", "jt4", "jt5", "jt6"]
        assert state.position == pytest.approx(position.joints, abs=1e-9)
        assert state.velocity == pytest.approx(position.velocity, abs=1e-9, rel=1e-9)
        T, place, q = position.T_world_tool, tool.pose.position, tool.pose.orientation
        assert (place.x, place.y, place.z) == pytest.approx((T.px, T.py, T.pz), abs=1e-9)
        assert rotated(q) == pytest.approx([T[i] for i in (0, 1, 2, 4, 5, 6, 8, 9, 10)], abs=1e-9)
    begun = [segment for before, segment in pairwise(timeline) if before.motion.number != segment.motion.number]
    assert [(ns, log.msg) for ns, log in found["/commands"]] == [(round(s.start * 1e9), s.motion.text) for s in begun]


def test_a_log_has_signals_and_the_hand() -> None:
    reader = pytest.importorskip("mcap_ros2.reader")
    changes = (Event(0.5, 1001, 1.0), Event(0.5, 3, 1.0, observed=True), Event(0.75, HAND, 0.5), Event(1.0, 1001, 0.0))
    stream = io.BytesIO()
    EXPORTERS["mcap"].write(stream, ARM, Timeline([initial()], 0, changes), 20.0)
    stream.seek(0)
    logged = [one for one in reader.read_ros2_messages(stream) if one.channel.topic == "/signals"]
    assert [(one.log_time_ns, one.ros_msg.msg) for one in logged] == [
        (500_000_000, "1001 on"),
        (750_000_000, "hand 0.5"),
        (1_000_000_000, "1001 off"),
    ]


def rotated(q) -> list[float]:
    """A unit quaternion as a rotation, row by row."""
    x, y, z, w = q.x, q.y, q.z, q.w
    return [
        1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
        2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
        2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y),
    ]  # fmt: skip


def test_a_log_has_an_index_and_names_its_robot() -> None:
    reader = pytest.importorskip("mcap.reader")
    stream = io.BytesIO()
    EXPORTERS["mcap"].write(stream, ARM, planned(3)[0], 20.0)
    stream.seek(0)
    log = reader.make_reader(stream)
    assert log.get_header().profile == "ros2"
    summary = log.get_summary()
    assert {channel.topic for channel in summary.channels.values()} == {"/joint_states", "/tool", "/tf", "/commands"}
    assert summary.statistics.message_start_time == 0
    assert next(iter(log.iter_metadata())).metadata["name"] == "puma560"


def test_a_log_reads_the_same_with_and_without_its_index() -> None:
    reader = pytest.importorskip("mcap.reader")
    stream = io.BytesIO()
    timeline, _ = planned(10)
    EXPORTERS["mcap"].write(stream, ARM, timeline, 2.5 * SAMPLES_PER_CHUNK / timeline.end)
    stream.seek(0)
    indexed = [(one[1].topic, one[2]) for one in reader.make_reader(stream, validate_crcs=True).iter_messages()]
    stream.seek(0)
    straight = [(one[1].topic, one[2]) for one in reader.NonSeekingReader(stream, validate_crcs=True).iter_messages()]
    assert indexed == straight
    assert [one.log_time for _, one in indexed] == sorted(one.log_time for _, one in indexed)
    stream.seek(0)
    summary = reader.make_reader(stream).get_summary()
    counts = {summary.channels[number].topic: n for number, n in summary.statistics.channel_message_counts.items()}
    assert counts == Counter(topic for topic, _ in indexed)
    assert len(summary.chunk_indexes) == summary.statistics.chunk_count == 4  # the end has a chunk of its own


def test_a_log_has_the_frames_of_parts_that_move() -> None:
    reader = pytest.importorskip("mcap.reader")
    arm = Arm("MOVE part").hand(1.0, 0.0).hand(0.0)
    arm.do("DEPARTS 100")
    timeline, world = arm.timeline, World(ARM, parse_cell(TABLE + BOX))
    stream = io.BytesIO()
    EXPORTERS["mcap"].write(stream, ARM, timeline, 20.0, world=world)
    stream.seek(0)
    told = list(reader.make_reader(stream).iter_messages(topics=["/tf"]))
    told = [one for one in told if one[2].data[4:8] == b"\1\0\0\0"]  # the others have the frames of links
    assert {schema.name for schema, _, _ in told} == {"tf2_msgs/msg/TFMessage"}
    assert [message.log_time for _, _, message in told] == sorted({message.log_time for _, _, message in told})
    for _, _, message in told:
        count, sec, nanosec = struct.unpack_from("<Iii", message.data, 4)
        assert (count, sec * 10**9 + nanosec) == (1, message.log_time)
        assert message.data[16:].startswith(b"\6\0\0\0world\0\0\0\4\0\0\0box\0")
        pose = world.course(timeline).state("box", message.log_time * 1e-9).pose
        assert struct.unpack("<7d", message.data[-56:])[:3] == pytest.approx(position(pose), abs=1e-9)
    assert struct.unpack("<7d", told[0][2].data[-56:])[:3] == (0.0, 0.55, -0.25)
    assert len(told) > 3


def transforms(data: bytes) -> Iterator[tuple[int, str, str, tuple[float, ...]]]:
    """The time [ns], parent, child and pose of each transform of a TFMessage, read by the rules of CDR."""
    body, at = data[4:], 0

    def taken(code: str) -> tuple[Any, ...]:
        nonlocal at
        at += -at % struct.calcsize(code[-1])
        found = struct.unpack_from(f"<{code}", body, at)
        at += struct.calcsize(f"<{code}")
        return found

    def text() -> str:
        (length,) = taken("I")
        return taken(f"{length}s")[0][:-1].decode()

    for _ in range(taken("I")[0]):
        sec, nanosec = *taken("i"), *taken("I")
        yield sec * 10**9 + nanosec, text(), text(), taken("7d")
    assert at == len(body)


@pytest.mark.parametrize("name", ["puma560", "cobra600", "so100", "iiwa14"])
def test_a_log_has_the_frame_of_each_link(name: str) -> None:
    reader = pytest.importorskip("mcap.reader")
    r = vrs.Robot(name)
    r.do("BASE 100, 50, -20, 30")
    r.tool = vrs.trans(10, 20, 30, 40, 50, 60)
    span = r.model.limits[:, 1] - r.model.limits[:, 0]
    r.move(r.model.limits[:, 0] + 0.3 * span).wait()
    stream = io.BytesIO()
    EXPORTERS["mcap"].write(stream, r.held.arm, r.timeline, 20.0)
    stream.seek(0)
    told = list(reader.make_reader(stream).iter_messages(topics=["/tf"]))
    assert len(told) == len(np.concatenate(list(sample_times(r.timeline, 20.0))))
    for _, _, message in told[:: len(told) // 7]:
        at, T = r.where(message.log_time * 1e-9), np.eye(4)
        names = ["world", "base", *(f"link{k}" for k in range(1, r.model.dof)), "flange", "tool"]
        names[1:] = [f"{name}/{one}" for one in names[1:]]
        frames = list(transforms(message.data))
        assert [(parent, child) for _, parent, child, _ in frames] == list(pairwise(names))
        for k, (ns, _, _, pose) in enumerate(frames):
            assert ns == message.log_time
            step = np.eye(4)
            step[:3, :3] = np.reshape(rotated(SimpleNamespace(**dict(zip("xyzw", pose[3:], strict=True)))), (3, 3))
            step[:3, 3] = pose[:3]
            T = T @ step
            there = at.location if k == r.model.dof + 1 else r.fk(at.joints, link=k)
            assert np.allclose(T, there.matrix, atol=1e-8), names[k + 1]


@pytest.mark.parametrize("angles", [(0, 0, 0), (180, 0, 0), (0, 180, 0), (0, 0, 180), (119, -170, 3), (90, 90, 90)])
def test_a_quaternion_of_any_rotation(angles: tuple[float, float, float]) -> None:
    pytest.importorskip("mcap")
    from vrs_cli.kinematics.arrays import quaternions

    T = from_oat(0.0, 0.0, 0.0, *(radians(angle) for angle in angles))
    R = np.array([[T[4 * i + j] for j in range(3)] for i in range(3)])
    ((x, y, z, w),) = quaternions(R[None])
    assert rotated(SimpleNamespace(x=x, y=y, z=z, w=w)) == pytest.approx(R.ravel(), abs=1e-12)
    assert w >= 0.0


# --- files ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(EXPORTERS))
def test_the_same_bytes_every_time_in_every_format(name: str) -> None:
    if name == "mcap":
        pytest.importorskip("mcap")
    timeline, _ = planned(5)
    streams = [io.BytesIO(), io.BytesIO()]
    for stream in streams:
        EXPORTERS[name].write(stream, ARM, timeline, 77.0)
    assert streams[0].getvalue() == streams[1].getvalue()


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "out.csv"
    timeline, _ = planned(2)
    export(EXPORTERS["csv"], str(path), io.BytesIO(), ARM, timeline, 10.0)
    assert path.read_text().count("\n") == len(rows_of(timeline, 10.0))
    with pytest.raises(FileError, match="no space left"):
        export(EXPORTERS["csv"], "/dev/full", io.BytesIO(), ARM, timeline, 10.0)


def test_minus_is_standard_output() -> None:
    output = io.BytesIO()
    export(EXPORTERS["csv"], "-", output, ARM, Timeline([initial()]), 10.0)
    assert output.getvalue().startswith(b"t,jt1,")
