"""The law of searches along the way of a tool: they find what samples close together find, and miss nothing.

python -m tests.laws.ways_of_tips 200
"""

from __future__ import annotations

from math import dist
from random import Random

import numpy as np

from tests.by_hand import command
from tests.teach.runs import SilentTerminal
from vrs_cli.engine.position import places_at
from vrs_cli.interfaces.station.station import Station
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Vector, length
from vrs_cli.teach.judging.basis import Evidence, evidence_of
from vrs_cli.teach.tip import Piece, greatest, nearest, tip_pieces, within

ROBOTS = ("puma560", "cobra600", "ur5e", "panda", "so100", "planar3")
PROFILES = ("LSPB", "SCURVE", "QUINTIC")
SAMPLES = 4000
PRECISION = 1e-6  # [m] of a search
STEP = 1e-3  # of a piece, or of a second: for differences


def random_run(rng: Random, robot: str) -> Evidence:
    """Run a random program; where a motion cannot be done it ends."""
    model = load_robot(robot)
    steps = [f"PARAMETER PROFILE = {rng.choice(PROFILES)}", "TOOL TRANS(20, -10, 90, 70, -60, 30)"]
    for _ in range(rng.randint(2, 6)):
        if rng.random() < 0.4:
            x, y, z = (rng.uniform(-80, 80) for _ in range(3))
            steps.append(f"MOVES SHIFT(DEST BY {x:.3f}, {y:.3f}, {z:.3f})")
        else:
            steps.append(
                f"DRIVE {rng.randint(1, model.joint_count)}, {rng.uniform(-60, 60):.3f}, {rng.randint(5, 100)}"
            )
        if rng.random() < 0.3:
            steps.append("BREAK")
    station = Station(SilentTerminal(), model)
    station.load_text("\n".join([".PROGRAM way", *steps, ".END", ""]))
    return evidence_of(station, station.execute("way"))


def check(rng: Random, ran: Evidence) -> None:
    """Compare searches with samples."""
    end = ran.end
    pieces = [tip_pieces(ran.arm, ran.timeline, 0.0, end, order) for order in range(3)]
    times = np.linspace(0.0, end, SAMPLES)
    tips = places_at(ran.arm, ran.timeline, times).T_world_tool[:, :, 3]
    for row in pieces:
        for piece in row:
            check_bend(rng, piece)
    target: Vector = tuple(tips[rng.randrange(SAMPLES)] + [rng.uniform(-0.1, 0.1) for _ in range(3)])  # type: ignore[assignment]
    far = np.linalg.norm(tips - target, axis=1)
    found = nearest(pieces[0], target, PRECISION)
    assert found.value <= far.min() + PRECISION, (found, far.min())
    assert found.value >= far.min() - np.abs(np.diff(far)).max(), (found, far.min())
    radius = float(rng.uniform(far.min(), far.max()))
    spans = within(pieces[0], target, radius, PRECISION)
    inside = np.zeros(SAMPLES, dtype=bool)
    for begin, until in spans:
        inside |= (times >= begin - 2e-4) & (times <= until + 2e-4)
    assert not (~inside & (far < radius - 10.0 * PRECISION)).any()
    sure = np.ones(SAMPLES, dtype=bool)
    for begin, until in spans:
        sure &= (times < begin + 2e-4) | (times > until - 2e-4)
    assert not (~sure & (far > radius + 10.0 * PRECISION)).any()
    speeds = np.linalg.norm(np.diff(tips, axis=0), axis=1) / np.diff(times)
    assert greatest(pieces[1], length, 1e-5).value >= speeds.max() - 1e-4
    rates = [np.array(piece.at(s)) for piece in pieces[1] for s in (0.0, 0.5 * (piece.finish - piece.start))]
    assert greatest(pieces[1], length, 1e-5).value >= max(np.linalg.norm(rate) for rate in rates) - 1e-5


def check_bend(rng: Random, piece: Piece) -> None:
    """Check that a curve is no farther from its chords than its bend allows."""
    lasting = piece.finish - piece.start
    for _ in range(5):
        s, h = rng.uniform(0.0, lasting), rng.uniform(0.0, 0.3) * lasting
        if h < 1e-4 or s + h > lasting:
            continue
        a, middle, b = (piece.at(s + k * h / 2) for k in range(3))
        off = dist(middle, tuple(0.5 * (x + y) for x, y in zip(a, b, strict=True)))
        assert off <= 0.125 * piece.bend * h * h * (1.0 + 1e-6) + 1e-9, (off, piece, h)


def main(count: int = 200) -> int:
    """Check so many random programs."""
    for seed in range(count):
        rng = Random(seed)
        robot = rng.choice(ROBOTS)
        ran = random_run(rng, robot)
        if ran.end > 0.0:
            try:
                check(rng, ran)
            except AssertionError as error:
                print(f"seed {seed}, {robot}: {error}")
                return 1
    print(f"{count} programs")
    return 0


if __name__ == "__main__":
    command(main)
