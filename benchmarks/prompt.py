"""What a line of the prompt costs where many names are defined: `python -m benchmarks.prompt [names]`.

Lines at 100 names and at many, in one run, on a session that somebody sits at: each is read, checked, carried out, and
what no file holds is kept in mind. Bar: at most 1.2 times as long with 12,000 names.
"""

from __future__ import annotations

import sys
from time import process_time

from benchmarks.program import Silent
from vrs_cli.interfaces.session.session import Session
from vrs_cli.values.questions import Answer, Question

BAR = 1.2
FEW, MANY = 100, 12_000
REPEATS = 40
LINES = ("n = n+1", "SET b = a", "LISTR n", "a", "SIGNAL 1")


class Somebody(Silent):
    """A terminal with somebody at it, who is never asked."""

    attended = True

    def ask(self, question: Question) -> Answer:
        raise AssertionError(question)


def session_with(names: int) -> Session:
    session = Session(Somebody())
    reals = "\n".join(f"v{number} {number}" for number in range(names))
    session.load_text(f".REALS\n{reals}\nn 1\n.END\n.LOCATIONS\na 500 150 -100 90 90 0\n.END\n")
    return session


def seconds(session: Session, line: str) -> float:
    """CPU of one line, as the shell sends it."""
    began = process_time()
    assert session.mistake(line) is None
    session.perform(line)
    session.unstored.state()
    return process_time() - began


def compared(many: int) -> list[tuple[str, float, float]]:
    """Each line with the least of many times, at few names and at many."""
    sessions = session_with(FEW), session_with(many)
    rows = []
    for line in LINES:
        times = [[seconds(session, line) for session in sessions] for _ in range(REPEATS)]
        rows.append((line, min(few for few, _ in times), min(lot for _, lot in times)))
    return rows


def main() -> None:
    many = int(sys.argv[1]) if len(sys.argv) > 1 and sys.argv[1].isdigit() else MANY
    for line, few, lot in compared(many):
        print(f"{line:10} {1e6 * few:6.0f} us at {FEW} names, {1e6 * lot:6.0f} us at {many}: {lot / few:.2f}")
    print(f"bar: {BAR}")


if __name__ == "__main__":
    main()
