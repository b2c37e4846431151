"""Trajectory files with something changed in them, and the laws of what is still read of them.

`python -m tests.files.mutations COUNT [FIRST]` tries as many as one likes, with checksums and without.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

import numpy as np

from tests.by_hand import command
from tests.files.trajectories import initial, planned, puma, without_checksums
from vrs_cli.engine.problem import segment_joints, state_at
from vrs_cli.errors import FileDamaged
from vrs_cli.files.trajectory_file import Recording, read_trajectory, write_trajectory
from vrs_cli.kinematics.forms import arm_for

NUMBER = re.compile(rb"(?<=[\[:,])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
KEY = re.compile(rb'"[a-z_]+"(?=:)')
EXTREME = (
    b"0",
    b"-1",
    b"1e308",
    b"-1e308",
    b"1e-320",
    b"1e999",
    b"9007199254740993",
    b"9" * 400,
    b"null",
    b"[]",
    b'""',
)
PLACE, RATE = 2e-5, 2e-4  # [rad, rad/s] what is no jump
PARTS = 40  # of a segment
STEP, LEAST_STEP = 3.0, 1e-3  # of what a joint can go from part to part, and [rad]: what is no jump inside a segment
NEAR = (1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 10.0)

Mutation = Callable[[Random, bytes], bytes]


def byte(rng: Random, data: bytes) -> bytes:
    at = rng.randrange(len(data))
    return data[:at] + bytes([rng.randrange(256)]) + data[at + 1 :]


def number(rng: Random, data: bytes) -> bytes:
    """Another number: a little more, another sign, another of the file, or an extreme one."""
    found = rng.choice(list(NUMBER.finditer(data)))
    value = float(found[0])
    change = rng.randrange(4)
    if change == 0:
        new = repr(value + rng.choice(NEAR) * rng.choice((-1.0, 1.0))).encode()
    elif change == 1:
        new = repr(-value).encode()
    elif change == 2:
        new = rng.choice(NUMBER.findall(data))
    else:
        new = rng.choice(EXTREME)
    return data[: found.start()] + new + data[found.end() :]


def field(rng: Random, data: bytes) -> bytes:
    """A key with another's name, or a word of a value in place of another."""
    found = rng.choice(list(KEY.finditer(data)))
    return data[: found.start()] + rng.choice(KEY.findall(data)) + data[found.end() :]


def dropped(rng: Random, data: bytes) -> bytes:
    lines = data.splitlines(keepends=True)
    del lines[rng.randrange(len(lines))]
    return b"".join(lines)


def doubled(rng: Random, data: bytes) -> bytes:
    lines = data.splitlines(keepends=True)
    at = rng.randrange(len(lines))
    return b"".join([*lines[: at + 1], *lines[at:]])


def swapped(rng: Random, data: bytes) -> bytes:
    lines = data.splitlines(keepends=True)
    i, j = rng.sample(range(len(lines)), 2)
    lines[i], lines[j] = lines[j], lines[i]
    return b"".join(lines)


MUTATIONS: tuple[Mutation, ...] = (byte, number, number, number, field, dropped, doubled, swapped)


def written(folder: Path, seed: int, *, checksums: bool) -> bytes:
    """A file of motions of all kinds, the bytes of it."""
    path = folder / "whole.vrst"
    write_trajectory(path, puma(), [initial()], planned(5, seed)[1])
    return (path if checksums else without_checksums(path)).read_bytes()


def read_mutant(folder: Path, rng: Random, data: bytes) -> Recording | None:
    """What a changed file is read as, or None where it is refused."""
    path = folder / "mutant.vrst"
    path.write_bytes(rng.choice(MUTATIONS)(rng, data))
    try:
        return read_trajectory(path)
    except FileDamaged:
        return None


def check_laws(recording: Recording) -> None:
    """The laws of motion, by other code than the reader's: what g says at many times."""
    model, timeline = recording.model, recording.timeline
    arm, lower, upper = arm_for(model), np.array(model.lower) - PLACE, np.array(model.upper) + PLACE
    for segment, after in zip(timeline, [*list(timeline)[1:], None], strict=True):
        s = np.linspace(0.0, segment.duration, PARTS)
        q = np.array([segment_joints(arm, segment, float(t)) for t in s])
        assert ((q >= lower) & (q <= upper)).all(), segment
        most = np.array(puma().max_velocity) * segment.duration / (PARTS - 1)
        assert (np.abs(np.diff(q, axis=0)) <= STEP * most + LEAST_STEP).all(), segment
        end = state_at(arm, segment, segment.duration).joints
        if after is None:
            assert np.abs(end.velocity).max() <= RATE
            continue
        begin = state_at(arm, after, 0.0).joints
        assert np.abs(np.subtract(end.joints, begin.joints)).max() <= PLACE, (segment, after)
        still = np.zeros(len(begin.velocity))
        pairs = [(end.velocity, begin.velocity)]
        if after.start > segment.finish:
            pairs = [(end.velocity, still), (still, begin.velocity)]
        for one, other in pairs:
            assert np.abs(np.subtract(one, other)).max() <= RATE * max(1.0, np.abs(one).max()), (segment, after)


def tried(folder: Path, count: int, first: int, *, checksums: bool) -> Counter[str]:
    """So many mutations: refused, read with warnings, or read as a trajectory that keeps the laws."""
    tally: Counter[str] = Counter()
    for seed in range(first, first + count):
        if seed % 25 == first % 25:
            data = written(folder, seed, checksums=checksums)
        recording = read_mutant(folder, Random(seed), data)
        if recording is None:
            tally["refused"] += 1
        elif recording.warnings:
            tally["warned"] += 1
        else:
            check_laws(recording)
            tally["read"] += 1
    return tally


def main(count: int, first: int = 1) -> None:
    with TemporaryDirectory() as folder:
        for name, checksums in (("with checksums", True), ("without", False)):
            print(f"{name}: {dict(tried(Path(folder), count, first, checksums=checksums))}", flush=True)


if __name__ == "__main__":
    command(main)
