"""How long one word holds a robot: the longest of its steps, in CPU time of the robot's thread, on a long timeline and
with many names: `python -m benchmarks longest [segments] [names]`.
"""

from __future__ import annotations

import os
import random
import sys
import tempfile
import time

from tests.interfaces.holders.holder import Holder
from vrs_cli.interfaces.dialogue import Reading, Running
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.text.collector import collect_in_small_parts
from vrs_cli.values.commands import JointTarget, Move
from vrs_cli.values.questions import Answer, Question
from vrs_cli.values.replies import Reply

SEGMENTS, NAMES = 100_000, 10_000
ALLOWED = 20.0  # [ms]
LINES = (
    *("MOVE p50", "MOVE p6 AT 1", "MOVES p57", "DRIVE 1, 1", "UNDO", "REDO", "UNDO 1000", "REDO 1000", "ABORT"),
    *("WHERE", "WHERE AT 1000", "WHERE FROM 0 TO 1000 STEP 1", "WHY p9", "STATUS", "TIMELINE", "PLOT", "PLOT SPEED"),
    *("BRANCH trial", "DRIVE 1, 1", "COMPARE main, trial", "MERGE trial", "BRANCH other", "BRANCH main"),
    *("DELETEB other", "SAVE day", "LOAD day.vrst", "BRANCH main", "REPLAY day", "STORE all", "LOAD all"),
    *("LISTL", "LISTR", "DIRECTORY", "STOREL all", "LOADL all", "LISTP prog1", "EXECUTE prog1", "EXECUTE busy"),
    *("DELETEL p1", "x = 1", "ZERO"),
)


class Quiet:
    """A terminal on which everybody agrees."""

    attended = False

    def show(self, reply: Reply) -> None:
        pass

    def type(self, text: str, newline: bool) -> None:
        pass

    def ask(self, question: Question) -> Answer:  # noqa: ARG002 (as terminals have it)
        return True

    def progress(self, doing: Running | Reading) -> None:
        pass


def main() -> None:
    segments, names = [int(text) for text in sys.argv[2:4]] or (SEGMENTS, NAMES)
    with tempfile.TemporaryDirectory() as folder, collect_in_small_parts():
        os.chdir(folder)
        session = crowded(segments, names)
        print(f"{len(session.engine.timeline)} segments, {names} names: the longest step of a word [ms of CPU]")
        steps, holder = timed(session), Holder(session)
        for line in LINES:
            steps.clear()
            ended = give(holder, line)
            longest, total = 1e3 * max(steps), 1e3 * sum(steps)
            mark = "  <-- longer" if longest > ALLOWED else ""
            print(f"{line:<30} {longest:8.1f} of {total:9.1f} in {len(steps):6} steps  {ended}{mark}", flush=True)
        session.actor.close()


def crowded(segments: int, names: int) -> Session:
    """A robot that has done a lot, and has a name for every place."""
    session = Session(Quiet())
    source, model = random.Random(1), session.engine.model
    for _ in range(segments // 3):
        somewhere = tuple(map(source.uniform, model.lower, model.upper))
        session.engine.perform(Move(JointTarget(somewhere), straight=False))
    places = "\n".join(f"p{k} {300 + k % 100} {k % 77} {k % 50} 90 90 0" for k in range(names))
    programs = "\n".join(f".PROGRAM prog{k}\nx = {k}\nTYPE x\n.END" for k in range(names // 10))
    session.load_text(f"{programs}\n.PROGRAM busy\nDO\nx = x+1\nUNTIL FALSE\n.END\n.LOCATIONS\n{places}\n.END\n")
    return session


def timed(session: Session) -> list[float]:
    """Serve it; the CPU time of each of its steps [s]."""
    steps: list[float] = []
    actor = session.actor
    step = actor._step

    def one() -> None:
        begun = time.thread_time()
        step()
        steps.append(time.thread_time() - begun)

    actor._step = one  # type: ignore[method-assign]
    actor.serve()
    return steps


def give(holder: Holder, line: str) -> str:
    """Carry out a line, with all questions answered by yes; how it ended."""
    ticket = holder.ask(line)
    if line == "EXECUTE busy":
        time.sleep(1.0)
        holder.stop()
    for said in ticket:
        if isinstance(said, Question):
            ticket.answer(said.id, True)
    error = ticket.error()
    return "" if error is None else str(error)[:60]


if __name__ == "__main__":
    main()
