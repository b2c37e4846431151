"""Random corners, rounded and stopped in: `python -m tests.laws.corners CORNERS [FIRST]`.

For each profile, each ROUNDING and each pair of motions so many corners. Prints how the time from the start to the end
of both motions compares with stopping in the corner; status 1 where rounding was slower by more than a millisecond.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from math import radians
from random import Random
from statistics import median

from vrs_cli.engine.commands import Break, Move, PoseTarget, SetParameter, SetSpeed
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform, compose, from_oat, rotation_x, rotation_y, translation

MODEL = load_robot("puma560")
PROFILES = ("LSPB", "SCURVE")
ROUNDINGS = ("DECEL", 5.0, 0.0, 60.0)
PAIRS = ("MOVES MOVES", "MOVES MOVE", "MOVE MOVES", "MOVE MOVE")
SLOWER = 1e-3  # [s] by which rounding may be slower than stopping
FARTHEST, TILT = 0.3, 0.6  # [m, rad] from the corner


@dataclass(frozen=True, slots=True)
class Corner:
    """Start, corner and end as T_world_tool, the pair of motions, and their speeds in percent."""

    places: tuple[Transform, Transform, Transform]
    straight: tuple[bool, bool]
    speeds: tuple[float, float]

    def lasting(self, profile: str, rounding: str | float, *, stopping: bool) -> tuple[Engine, float]:
        """The robot after both motions, and how long they took [s]. Raises MotionError."""
        engine, (start, corner, end) = Engine(MODEL), self.places
        engine.perform(SetParameter("PROFILE", profile))
        engine.perform(SetParameter("ROUNDING", rounding))
        engine.perform(Move(PoseTarget(start), False))
        begin = engine.end
        for place, straight, speed in zip((corner, end), self.straight, self.speeds, strict=True):
            engine.perform(SetSpeed(speed), program=True)
            engine.perform(Move(PoseTarget(place), straight, text="MOVE"), program=True)
            if stopping:
                engine.perform(Break())
        return engine, engine.end - begin


def random_corner(source: Random, pair: str = PAIRS[0]) -> Corner:
    """In front of the robot, lines of all lengths, half of them with a turn."""
    corner = from_oat(
        source.uniform(-0.25, 0.25),
        source.uniform(0.35, 0.55),
        source.uniform(-0.4, 0.0),
        radians(90.0 + source.uniform(-30.0, 30.0)),
        radians(90.0 - source.uniform(0.0, 40.0)),
        radians(source.uniform(-60.0, 60.0)),
    )
    first, second = pair.split()
    speeds = [source.choice((100.0, source.uniform(10.0, 100.0))) for _ in range(2)]
    return Corner(
        (_beside(source, corner), corner, _beside(source, corner)),
        (first == "MOVES", second == "MOVES"),
        (speeds[0], speeds[1]),
    )


def _beside(source: Random, corner: Transform) -> Transform:
    way = translation(*(source.choice((1.0, 0.3, 0.05)) * source.uniform(-FARTHEST, FARTHEST) for _ in "XYZ"))
    tilt = source.choice((0.0, TILT))
    turn = compose(rotation_x(source.uniform(-tilt, tilt)), rotation_y(source.uniform(-tilt, tilt)))
    return compose(compose(way, corner), turn)


def corners(source: Random, pair: str, profile: str, rounding: str | float) -> Iterator[tuple[Corner, float, float]]:
    """Corners that can be stopped in, with the time that they take rounded and stopped in [s]."""
    while True:
        corner = random_corner(source, pair)
        try:
            _, stopped = corner.lasting(profile, rounding, stopping=True)
        except MotionError:
            continue
        _, rounded = corner.lasting(profile, rounding, stopping=False)
        yield corner, rounded, stopped


def main(count: int, first: int = 1) -> int:
    """How many settings have a corner that is slower rounded."""
    faults = 0
    print("profile  rounding  motions      slower  worst s  worst ratio  median ratio  quartile")
    for profile, rounding, pair in product(PROFILES, ROUNDINGS, PAIRS):
        source = Random(f"{first} {profile} {rounding} {pair}")
        times = [(a, b) for _, (_, a, b) in zip(range(count), corners(source, pair, profile, rounding), strict=False)]
        ratios = sorted(a / b for a, b in times)
        slower = sum(a > b + SLOWER for a, b in times)
        worst = max(a - b for a, b in times)
        faults += slower > 0
        print(
            f"{profile:7}  {rounding!s:8}  {pair:11}  {slower:6}  {worst:7.3f}  {ratios[-1]:11.3f}"
            f"  {median(ratios):12.4f}  {ratios[len(ratios) // 4]:8.4f}",
            flush=True,
        )
    return faults


if __name__ == "__main__":
    sys.exit(1 if main(*map(int, sys.argv[1:3])) else 0)
