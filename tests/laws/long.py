"""Random sessions for as long as one likes: `python -m tests.laws.long SEEDS [FIRST] [COMMANDS] [ROBOT ...]`.

ROBOT is a built-in one or a file; without any, every built-in robot has so many sessions. Prints how many commands of
each robot kept every law, and the seed of every session that did not. Status 1 when there was one.
"""

from __future__ import annotations

import traceback
from collections.abc import Sequence

from tests.by_hand import command
from tests.laws.sessions import Session, Tally
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot, robot_names


def main(seeds: int, first: int = 1, commands: int = 200, robots: Sequence[RobotModel] = ()) -> int:
    run, models = range(first, first + seeds), robots or map(load_robot, robot_names())
    return 1 if sum([sessions(model, run, commands) for model in models]) else 0


def sessions(model: RobotModel, seeds: range, commands: int) -> int:
    """How many sessions of one robot broke a law."""
    total, faults = Tally(), 0
    for seed in seeds:
        session = Session(seed, model)
        try:
            session.run(commands)
        except Exception:
            faults += 1
            print(
                f"--- {model.name}, seed {seed}, command {session.tally.commands}\n{traceback.format_exc()}", flush=True
            )
        for name in vars(total):
            setattr(total, name, getattr(total, name) + getattr(session.tally, name))
    print(f"{model.name}: {len(seeds)} sessions, {total}, {faults} faults", flush=True)
    return faults


if __name__ == "__main__":
    command(main)
