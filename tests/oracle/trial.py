"""One random program: written, run by the product as a user would, and judged."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from tests.oracle import laws
from tests.oracle.programs import Motion, Settings, Statement, Writer, text_of
from tests.oracle.recording import Edit, edits
from tests.oracle.robot import Robot, load, names
from vrs_cli.cli.main import run

FEWEST = 3  # motions of a program
MOTIONS = ("MOVE", "APPRO", "DEPART", "DRIVE", "READY", "NEST")


@dataclass
class Trial:
    """`judge` runs the program in a folder; `faults` are the laws that it broke."""

    seed: int
    folder: Path
    most: int = 12
    motions: int = 0
    refused: int = 0
    robot: Robot = field(init=False)
    statements: list[Statement] = field(init=False)

    def __post_init__(self) -> None:
        random = Random(self.seed)
        self.robot = load(names()[self.seed % len(names())])
        self.statements = Writer(self.robot, random).program(random.randint(FEWEST, self.most))

    @property
    def program(self) -> str:
        return text_of(self.statements)

    def judge(self) -> list[str]:
        """The faults of this program."""
        told = self.run()
        if told["errors"]:
            return [f"the program stopped: {told['errors']}"]
        history = list(edits(self.folder / "trial.vrst"))
        found = list(self.laws_of_edits(history))
        if history:
            found += laws.every_millisecond(self.robot, history[-1].after, self.samples())
        return found

    def run(self) -> dict[str, Any]:
        """Execute the program; what `vrs run --json` tells."""
        source, saved = self.folder / "trial.v2", self.folder / "trial.vrst"
        source.write_text(self.program)
        saved.unlink(missing_ok=True)
        output = quietly("run", str(source), "--robot", self.robot.name, "--save", str(saved), "--json")
        return dict(json.loads(output))

    def samples(self) -> laws.Samples:
        table = self.folder / "trial.npz"
        quietly("export", str(self.folder / "trial.vrst"), "-o", str(table), "--rate", "1000")
        with np.load(table) as arrays:
            return laws.Samples(*(arrays[key] for key in ("times", "joints", "velocities", "xyz")))

    def laws_of_edits(self, history: list[Edit]) -> Iterator[str]:
        """Follow the program and the edits side by side: a motion without an edit was refused."""
        settings, asked, waiting = Settings(), dict[int, laws.Asked](), list(history)
        for statement in self.statements:
            statement.change(settings)
            while waiting and not waiting[0].motion["text"].startswith(MOTIONS):
                yield from laws.of_edit(laws.Case(self.robot, waiting.pop(0), asked))
            if not isinstance(statement, Motion):
                continue
            if not waiting or waiting[0].motion["text"] != statement.text:
                self.refused += 1
                if statement.sure:
                    yield f"{statement.text} was refused"
                continue
            self.motions += 1
            edit = waiting.pop(0)
            asked[edit.motion["number"]] = laws.Asked(statement, deepcopy(settings))
            yield from laws.of_edit(laws.Case(self.robot, edit, asked))
            settings.once = None
            if statement.joints is not None:
                settings.words.clear()
        told = (edit.motion["text"] for edit in waiting)
        yield from (f"{text} was not asked for" for text in told if text.startswith(MOTIONS))


def quietly(*arguments: str) -> str:
    """What a command line prints."""
    output = io.TextIOWrapper(io.BytesIO())
    with redirect_stdout(output), redirect_stderr(io.StringIO()):
        run(arguments)
    output.seek(0)
    return output.read()
