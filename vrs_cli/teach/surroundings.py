"""Reads what an exercise and a lesson have in common: the robot, the dialect, the cell around it, what is given."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vrs_cli.errors import FileError, VrsError
from vrs_cli.files.cell_file import read_cell
from vrs_cli.files.opening import text_at
from vrs_cli.interfaces.station.loaded_file import LoadedFile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.run.signals import NO_CELL, Cell
from vrs_cli.language.text.parser import parse_file
from vrs_cli.teach.exercise_text import ExerciseText
from vrs_cli.values.diagnostics import Severity
from vrs_cli.values.dialect import Dialect

MAX_PROGRAM_BYTES = 1_000_000  # of a submission, the model, and what is given


class SurroundingsReader:
    """Reads the files in the folder `around` and collects the mistakes in them."""

    def __init__(self, around: Path) -> None:
        self.around, self.wrong = around, list[str]()

    def robot(self, reader: ExerciseText, table: Mapping[str, Any]) -> RobotModel | None:
        """Load the robot, a built-in one or a file in the folder; None where there is none."""
        given = table.get("robot", "puma560")
        if not isinstance(given, str):
            reader.fault(reader.whole, "robot", 'the name of a robot, such as "puma560"')
            return None
        beside = self.around / given
        try:
            return load_robot(beside if beside.suffix in (".toml", ".urdf") and beside.is_file() else given)
        except VrsError as error:
            reader.fault(reader.whole, "robot", str(error))
            return None

    def dialect(self, reader: ExerciseText, table: Mapping[str, Any]) -> Dialect:
        """Read the dialect of what is typed and loaded."""
        entry = reader.whole._replace(given=table)
        if "dialect" not in table:
            return Dialect.VPLUS
        word = reader.one_of(entry, "dialect", (one.value for one in Dialect))
        return next((one for one in Dialect if one.value == word), Dialect.VPLUS)

    def cell(self) -> Cell:
        """Read cell.toml."""
        path = self.around / "cell.toml"
        try:
            return read_cell(str(path)) if path.exists() else NO_CELL
        except FileError as error:
            self.wrong.append(error.detail)
            return NO_CELL

    def given(self, robot: RobotModel, dialect: Dialect) -> LoadedFile | None:
        """Read given.v2: its programs and locations."""
        path = self.around / "given.v2"
        if not path.exists():
            return None
        try:
            text = text_at(str(path), MAX_PROGRAM_BYTES)
        except FileError as error:
            self.wrong.append(error.detail)
            return None
        file, unreadable = parse_file(text, dialect)
        loaded = LoadedFile.of(file, text, Memory(units=robot.units), vplus=True)
        for one in (*unreadable, *loaded.diagnostics):
            if one.severity is Severity.ERROR:
                self.wrong.append(f"{path}:{one.span.line}: {one.message}")
        return loaded
