"""Random corners, rounded and stopped in: `python -m tests.laws.corners CORNERS [FIRST]`.

For each profile, each ROUNDING and each pair of motions so many corners. Prints how the time from the start to the end
of both motions compares with stopping in the corner; status 1 where rounding was slower by more than a millisecond.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice, product
from math import inf, radians
from random import Random
from statistics import median

from tests.by_hand import command
from vrs_cli.engine.engine import Engine
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import Transform, compose, from_oat, rotation_x, rotation_y, translation
from vrs_cli.trajectory.segment import Phase
from vrs_cli.values.commands import Break, Move, PoseTarget, SetParameter, SetSpeed, Stamp

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

    def driven(self, profile: str, rounding: str | float, *, stopping: bool) -> Engine:
        """The robot after both motions. Raises MotionError."""
        engine, (start, corner, end) = Engine(MODEL), self.places
        engine.perform(SetParameter("PROFILE", profile))
        engine.perform(SetParameter("ROUNDING", rounding))
        engine.perform(Move(PoseTarget(start), False))
        for place, straight, speed in zip((corner, end), self.straight, self.speeds, strict=True):
            engine.perform(SetSpeed(speed), program=True)
            engine.perform(Move(PoseTarget(place), straight), program=True)
            if stopping:
                engine.perform(Break())
        return engine


@dataclass(frozen=True, slots=True)
class Ends:
    """When both motions of a corner are over [s], rounded and stopped in; inf where they are refused."""

    rounded: float
    stopped: float
    begin: float

    @property
    def ratio(self) -> float:
        return (self.rounded - self.begin) / (self.stopped - self.begin)

    @property
    def slower(self) -> bool:
        return self.rounded > self.stopped + SLOWER


def ends(corner: Corner, profile: str, rounding: str | float) -> tuple[Engine | None, Ends]:
    """The robot that has rounded it, too. Raises MotionError where the corner cannot be stopped in."""
    stopped = corner.driven(profile, rounding, stopping=True)
    begin = stopped.book.records()[0].end or 0.0
    try:
        rounded = corner.driven(profile, rounding, stopping=False)
    except MotionError:
        return None, Ends(inf, stopped.end, begin)
    return rounded, Ends(rounded.end, stopped.end, begin)


def spliced(corner: Corner, profile: str, rounding: str | float, place: Transform, part: float) -> Ends:
    """`ends`, once a MOVE to another place has come in a part of the first motion, so that the second is planned again.
    Raises MotionError.
    """
    stopped, rounded = (corner.driven(profile, rounding, stopping=stopping) for stopping in (True, False))
    slows = min(s.start for s in stopped.timeline if s.motion.number == 2 and s.phase is Phase.DECELERATE)
    first = stopped.book.records()[0].end or 0.0
    at = first + part * (slows - first)
    for engine in (stopped, rounded):
        engine.perform(Move(PoseTarget(place), False, stamp=Stamp(at)))
    return Ends(rounded.end, stopped.end, at)


def random_corner(source: Random, pair: str = PAIRS[0]) -> Corner:
    """In front of the robot, ways of all lengths, half of them with a turn."""
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
        (beside(source, corner), corner, beside(source, corner)),
        (first == "MOVES", second == "MOVES"),
        (speeds[0], speeds[1]),
    )


def beside(source: Random, corner: Transform) -> Transform:
    way = translation(*(source.choice((1.0, 0.3, 0.05)) * source.uniform(-FARTHEST, FARTHEST) for _ in "XYZ"))
    tilt = source.choice((0.0, TILT))
    turn = compose(rotation_x(source.uniform(-tilt, tilt)), rotation_y(source.uniform(-tilt, tilt)))
    return compose(compose(way, corner), turn)


def corners(source: Random, pair: str, profile: str, rounding: str | float) -> Iterator[tuple[Corner, Ends]]:
    """Corners that can be stopped in."""
    while True:
        corner = random_corner(source, pair)
        with suppress(MotionError):
            yield corner, ends(corner, profile, rounding)[1]


def main(count: int, first: int = 1) -> int:
    faults = 0
    print("profile  rounding  motions      slower  worst s  worst ratio  median ratio  quartile")
    for profile, rounding, pair in product(PROFILES, ROUNDINGS, PAIRS):
        source = Random(f"{first} {profile} {rounding} {pair}")
        times = [times for _, times in islice(corners(source, pair, profile, rounding), count)]
        ratios = sorted(each.ratio for each in times)
        slower = sum(each.slower for each in times)
        worst = max(each.rounded - each.stopped for each in times)
        faults += slower > 0
        print(
            f"{profile:7}  {rounding!s:8}  {pair:11}  {slower:6}  {worst:7.3f}  {ratios[-1]:11.3f}"
            f"  {median(ratios):12.4f}  {ratios[count // 4]:8.4f}",
            flush=True,
        )
    return 1 if faults else 0


if __name__ == "__main__":
    command(main)
