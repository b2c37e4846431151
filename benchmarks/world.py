"""1,000 parts and ten light barriers; a hand takes 100 of the parts elsewhere: `python -m benchmarks world`."""

from __future__ import annotations

import random
from typing import NamedTuple

from benchmarks.program import Silent
from benchmarks.report import Figure, show
from benchmarks.timeline import cpu
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.transform import translation
from vrs_cli.language.run.signals import Cell
from vrs_cli.values.scene import Beam, BoxShape, CellScene, Fixture, ScenePart, Sensor
from vrs_cli.world.course import World

COLUMNS, ROWS = 40, 25  # of parts, 20 mm wide
TAKEN = 100
PROGRAM = """
.PROGRAM work()
    OPENI
    FOR part = 0 TO 99
        SET from = TRANS(-390+20*part-800*INT(part/40), 470+20*INT(part/40), -250, 90, 90, 0)
        APPRO from, 50
        MOVE from
        CLOSEI
        DEPART 50
        APPRO SHIFT(from BY 0, -110, 0), 50
        MOVE SHIFT(from BY 0, -110, 0)
        OPENI
        DEPART 50
    END
    BREAK
.END
"""


class Costs(NamedTuple):
    """Seconds of the processor: of the first course, one after a command at the end, and one after a command at the
    beginning, which shifts all; of the states of all parts at one time.
    """

    first: float
    at_end: float
    shifted: float
    states: float


def scene() -> CellScene:
    parts = tuple(
        ScenePart(
            f"part.{k}",
            BoxShape((0.016, 0.016, 0.04)),
            translation(-0.39 + 0.02 * (k % COLUMNS), 0.47 + 0.02 * (k // COLUMNS), -0.25),
            (0.8, 0.2, 0.2),
            0.1,
        )
        for k in range(COLUMNS * ROWS)
    )
    table = Fixture("table", BoxShape((1.2, 1.4, 0.02)), translation(0.0, 0.5, -0.28), (0.6, 0.6, 0.6))
    sensors = tuple(
        Sensor(f"gate.{k}", 1001 + k, Beam((-0.4 + 0.08 * k, 0.0, -0.215), (-0.4 + 0.08 * k, 0.9, -0.215), 0.0005))
        for k in range(10)
    )
    return CellScene(parts, (table,), sensors)


def costs() -> Costs:
    session = Session(Silent())
    session.load_text(PROGRAM)
    session.execute("work")
    world, engine, R = World(session.engine.arm, Cell(scene=scene())), session.engine, random.Random(1)

    def settle() -> None:
        course = world.course(engine.timeline)
        assert course.notes == ()

    first = cpu(settle)
    t = R.uniform(0.0, engine.end)
    course = world.course(engine.timeline)
    states = cpu(lambda: [course.state(name, t) for name in course.parts()])
    assert sum(course.spans(f"part.{k}")[-1].kind.value == "rests" for k in range(TAKEN)) == TAKEN
    assert all(len(course.spans(f"part.{k}")) == 3 for k in range(TAKEN))
    session.perform("DRIVE 1, 5")
    at_end = cpu(settle)
    session.perform("DRIVE 6, 5 AT 0.02")
    return Costs(first, at_end, cpu(settle), states)


def main() -> None:
    found = costs()
    show(
        f"{COLUMNS * ROWS} parts, {TAKEN} of them taken elsewhere",
        [
            Figure("the first course", 1e6 * found.first),
            Figure("after a command at the end", 1e6 * found.at_end),
            Figure("after a command at the beginning", 1e6 * found.shifted),
            Figure("the states of all parts at one time", 1e6 * found.states),
        ],
    )


if __name__ == "__main__":
    main()
