"""Random sensors beside dense sampling by another method; for longer: python -m tests.world.sensors 100"""

from __future__ import annotations

import random
from collections.abc import Iterator
from math import dist

from tests.by_hand import command
from tests.world.cells import TABLE, Arm
from tests.world.oracle import gap
from vrs_cli.files.cell_file import parse_cell
from vrs_cli.kinematics.transform import Transform, Vector, compose, from_oat, position
from vrs_cli.language.run.signals import Cell
from vrs_cli.values.scene import (
    Beam,
    BoxShape,
    CellScene,
    CylinderShape,
    Proximity,
    ScenePart,
    Sensor,
    Shape,
    SphereShape,
    Zone,
)
from vrs_cli.world.course import World, WorldCourse

NEAR = 1e-6  # [s] the state at a change is that of either side
LARGEST = 0.06  # [m] from the middle of a part or of the hand to its corners
SHAPES = (BoxShape((0.04, 0.05, 0.06)), CylinderShape(0.02, 0.06), SphereShape(0.025))


def an_arm(R: random.Random) -> Arm:
    """It takes the part, carries it on joint-interpolated and straight motions, and lets it fall."""
    arm = Arm("MOVE part").hand(1, 0.0).hand(0).do("DELAY 0.1", "DEPARTS 80")
    for _ in range(3):
        x, y, z, roll = R.uniform(-200, 300), R.uniform(400, 600), R.uniform(-150, 50), R.uniform(-90, 90)
        arm.do(f"SPEED {R.choice((30, 100))}", f"{R.choice(('MOVE', 'MOVES'))} TRANS({x}, {y}, {z}, 90, 90, {roll})")
    return arm.hand(1)


def a_region(R: random.Random, near: Transform, *, box: bool) -> Beam | Zone | Proximity:
    """A region that the part probably meets."""
    x, y, z = (near[3 + 4 * axis] + R.uniform(-0.03, 0.03) for axis in range(3))
    dx, dy, dz = (R.gauss(0.0, 0.1) for _ in range(3))
    kind = R.randrange(3 if box else 2)
    if kind == 0:
        return Beam((x - dx, y - dy, z - dz), (x + dx, y + dy, z + dz), R.choice((0.0005, 0.003)))
    if kind == 1:
        length = (dx * dx + dy * dy + dz * dz) ** 0.5
        return Proximity((x, y, z), (dx / length, dy / length, dz / length), R.uniform(0.005, 0.1), 0.0005)
    return Zone(from_oat(x, y, z, dx * 10, dy * 10, dz * 10), (0.03, 0.05, 0.04))


def course_with_sensors(R: random.Random, count: int) -> tuple[WorldCourse, CellScene]:
    arm, shape = an_arm(R), R.choice(SHAPES)
    T = (
        parse_cell('[[part]]\nname = "a"\nshape = "sphere"\nradius = 1\nat = [0, 550, -250]')
        .scene.parts[0]
        .T_world_part
    )
    part = ScenePart("part", shape, T, (1.0, 0.0, 0.0), 0.1)
    table = parse_cell(TABLE).scene
    scene = CellScene((part,), table.fixtures, floor=table.floor)
    blind = World(arm.engine.arm, Cell(scene=scene)).course(arm.timeline)
    begin, end = blind.spans("part")[1].begin, arm.timeline.end
    sensors = tuple(
        Sensor(
            f"s{k}",
            1001 + k,
            a_region(R, blind.state("part", R.uniform(begin, end + 0.2)).pose, box=shape is SHAPES[0]),
        )
        for k in range(count)
    )
    seen = CellScene((part,), table.fixtures, sensors, floor=table.floor)
    return World(arm.engine.arm, Cell(scene=seen)).course(arm.timeline), seen


def disagreements(course: WorldCourse, scene: CellScene, step: float) -> Iterator[str]:
    """Where the states of the sensors are not those of the samples."""
    (part,), hand, since = scene.parts, BoxShape(scene.gripper.size), course.timeline.start
    last = course.timeline.end + 0.3
    course.spans("part", last)

    def bodies(t: float) -> tuple[tuple[Shape, Transform], tuple[Shape, Transform]]:
        T_hand = compose(course.tool(t), course._settings.hand.T)
        return (part.shape, course.state("part", t).pose), (hand, T_hand)

    samples = [(t, bodies(t)) for t in (since + step * k for k in range(int((last - since) / step)))]
    for sensor in scene.sensors:
        middle, reach = extent(sensor.region)
        changes = [(t, on) for t, number, on in course._history.rows("changes") if number == sensor.signal]
        instants = [(t + side, bodies(t + side)) for t, _ in changes if t > since for side in (-NEAR, NEAR)]
        for t, seen in (*samples, *instants):
            expected = any(dist(position(T), middle) < reach and gap(shape, T, sensor.region) <= 0 for shape, T in seen)
            if course.signal(sensor.signal, t) is not expected and all(abs(t - at) > 0.99 * NEAR for at, _ in changes):
                yield f"{sensor}: at {t:.7f} s it should be {expected}"


def extent(region: Beam | Zone | Proximity) -> tuple[Vector, float]:
    """The middle of a region, and how near a body's middle is to it if the body may be in the region [m]."""
    if isinstance(region, Zone):
        return position(region.T_world_zone), LARGEST + sum(region.size)
    if isinstance(region, Proximity):
        return region.place, LARGEST + region.range
    x, y, z = (0.5 * (a + b) for a, b in zip(region.begin, region.end, strict=True))
    return (x, y, z), LARGEST + 0.5 * dist(region.begin, region.end)


def run(seed: int, count: int = 10, step: float = 1e-3) -> tuple[int, list[str]]:
    """How many changes there are, and the disagreements."""
    R = random.Random(seed)
    course, scene = course_with_sensors(R, count)
    found = list(disagreements(course, scene, step))
    return len(course._history.rows("changes")), found


def main(count: int) -> int:
    changes = wrong = 0
    for number in range(count):
        done, told = run(number)
        changes, wrong = changes + done, wrong + len(told)
        for line in told[:3]:
            print(f"seed {number}: {line}")
    print(f"{count} courses of 10 sensors, {changes} changes, {wrong} samples and instants disagree")
    return int(wrong > 0)


if __name__ == "__main__":
    command(main)
