"""Random sessions for as long as one likes: `python -m tests.laws.long SEEDS [FIRST] [COMMANDS]`.

Prints how many commands kept every law, and the seed of every session that did not. Status 1 when there was one.
"""

from __future__ import annotations

import sys
import traceback

from tests.laws.sessions import Session, Tally


def main(seeds: int, first: int = 1, commands: int = 200) -> int:
    total, faults = Tally(), 0
    for seed in range(first, first + seeds):
        session = Session(seed)
        try:
            session.run(commands)
        except Exception:
            faults += 1
            print(f"--- seed {seed}, command {session.tally.commands}\n{traceback.format_exc()}", flush=True)
        for name in vars(total):
            setattr(total, name, getattr(total, name) + getattr(session.tally, name))
    print(f"{seeds} sessions: {total}, {faults} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))
