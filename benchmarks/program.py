"""Ten minutes of robot time in batch: `python -m benchmarks.program`.

The program picks and places with joint-interpolated and straight-line motions, loops, signals and arithmetic, until
the robot's clock has passed ten minutes: in a round whose lines come again, and with every place new. Seconds are CPU.
Each run begins with nothing remembered of earlier runs: what f remembers is forgotten, and RANDOM has another seed.
"""

from __future__ import annotations

from itertools import count
from random import Random
from time import process_time

from benchmarks.engine import forget_plans
from vrs_cli.interfaces.dialogue import Reading, Running
from vrs_cli.interfaces.session.session import Session
from vrs_cli.values.questions import Answer, Question
from vrs_cli.values.replies import Reply

REPEATS = 5
SEEDS = count(1)  # of RANDOM, another for each run

PROGRAM = """\
.PROGRAM work()
    parts = 0
    READY
    WHILE TIME() < 600 DO
        FOR place = 0 TO 3
            APPRO feeder, 60
            MOVES feeder
            CLOSEI
            DEPARTS 60
            SET goal = SHIFT(tray BY place*60, 0, 0)
            APPRO goal, 60
            MOVES goal
            OPENI
            DEPARTS 60
            parts = parts+1
            SIGNAL 2001, -2002
        END
    END
    BREAK
    TYPE /I0, parts, " parts"
.END
.LOCATIONS
feeder   300 350 -200 90 90 0
tray    -250 500 -220 90 90 0
.END
"""
ANEW = "SET part = SHIFT(feeder BY 40*RANDOM, 40*RANDOM, 20*RANDOM)"
NEW = PROGRAM.replace("APPRO feeder, 60", f"{ANEW}\n            APPRO part, 60").replace("MOVES feeder", "MOVES part")
NEW = NEW.replace("place*60, 0, 0", "place*60+20*RANDOM, 40*RANDOM, 20*RANDOM")


MOVES = """\
.PROGRAM moves()
    FOR i = 1 TO {count}
        MOVE #PPOINT(320*RANDOM-160, 220*RANDOM-200, 220*RANDOM-20, 200*RANDOM-100, 180*RANDOM-90, 200*RANDOM-100)
    END
.END
"""


class Silent:
    """A terminal that says nothing, at which nobody sits."""

    attended = False

    def show(self, reply: Reply) -> None:
        del reply

    def type(self, text: str, newline: bool) -> None:
        del text, newline

    def ask(self, question: Question) -> Answer:
        del question

    def progress(self, doing: Running | Reading) -> None:
        del doing


def moved(count: int) -> Session:
    """A session after a program with so many joint motions, each of which begins before the previous one ends."""
    session = Session(Silent())
    session.environment.random = Random(1)
    session.load_text(MOVES.format(count=count))
    if (fault := session.execute("moves").fault) is not None:
        raise SystemExit(fault.message)
    return session


def run_once(program: str) -> tuple[float, float, int]:
    """Seconds of computing, seconds of the robot, motions."""
    session = Session(Silent())
    session.environment.random = Random(next(SEEDS))
    forget_plans()
    begin = process_time()
    session.load_text(program)
    result = session.execute("work")
    took = process_time() - begin
    if result.fault is not None:
        raise SystemExit(result.fault.message)
    return took, result.ended, len(session.engine.book.records())


def main() -> None:
    run_once(PROGRAM)  # imports and caches
    for title, program in (("the same places", PROGRAM), ("every place new", NEW)):
        runs = [run_once(program) for _ in range(REPEATS)]
        took = min(run[0] for run in runs)
        _, robot, motions = runs[0]
        print(
            f"{title}: {robot:.0f} s of the robot, {motions} motions: {took * 1e3:.0f} ms, {robot / took:.0f} s per s"
        )


if __name__ == "__main__":
    main()
