"""A session that is killed (kill -9) in the middle of its commands, again and again, on one journal."""

from __future__ import annotations

import random
from pathlib import Path

from tests.files.contest import Vrs
from vrs_cli.files.trajectory_file import read_trajectory

DAY = "day.vrst"
MOST = 12  # commands of a session


def killed(folder: Path, seed: int, acknowledged: list[str]) -> None:
    """One more session: it goes on with the file, and is killed while commands are under way. `acknowledged`: what all
    sessions so far have answered, which has to be in the file."""
    choose = random.Random(seed)
    with Vrs(seed, folder, "--save", DAY) as one:
        one.go()
        texts = [f"DRIVE 6, {choose.choice((-1, 1)) * (1 + seed / 1000 + k / 100000):.5f}" for k in range(MOST)]
        one.send(*(line for text in texts for line in (text, f'TYPE "{text}"')))
        answers = choose.randrange(MOST + 1)
        while answers and (said := one.line()) is not None:
            if said in texts:
                acknowledged.append(said)
                answers -= 1
        one.kill()
    if not (folder / DAY).exists():
        assert not acknowledged
        return
    written = [delta.motion.text for delta in read_trajectory(folder / DAY).deltas]
    found = iter(written)
    assert all(text in found for text in acknowledged), f"lost in session {seed}"
    assert len(written) == len(set(written)), f"twice in session {seed}"
