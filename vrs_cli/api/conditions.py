"""Conditions of a call or a robot in Python: limits, a folder for files, a cell, inputs that change."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TypeAlias

from msgspec import Struct, field, structs

from vrs_cli.engine.clock import RobotClock
from vrs_cli.errors import FileError
from vrs_cli.files.cell_file import read_cell
from vrs_cli.files.opening import Folder
from vrs_cli.files.timed_lines import listed_signals, read_signals
from vrs_cli.interfaces.port.local import LocalPort
from vrs_cli.interfaces.port.port import Console
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.station import Conditions
from vrs_cli.interfaces.tasks.limits import Limits
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.language.run.signals import NO_INPUTS, Cell

Signals: TypeAlias = str | Path | Iterable[tuple[float, int, bool]]
CURRENT = Folder(closed=True, disclosed=True)


def conditions_of(
    limits: Limits | None, folder: str | Path | None, cell: str | Path | Cell | None, signals: Signals | None
) -> Conditions | None:
    """Return the conditions of a call; None where nothing is given. Raises TypeError, NonexistentFile, FileError,
    FileDamaged.
    """
    if limits is None and folder is None and cell is None and signals is None:
        return None
    if not isinstance(limits, Limits | None):
        raise TypeError(f"limits: a Limits is wanted, as vrs.Limits(max_steps=1000) makes one, not {limits!r}")
    if signals is None:
        inputs = NO_INPUTS
    else:
        inputs = read_signals(str(signals)) if isinstance(signals, str | Path) else listed_signals(signals)
    return Conditions(
        limits=limits,
        folder=None if folder is None else _folder(Path(folder)),
        cell=read_cell(str(cell)) if isinstance(cell, str | Path) else cell,
        inputs=inputs,
    )


def _folder(path: Path) -> Folder:
    """Raises FileError for what is no folder."""
    if not path.is_dir():
        raise FileError(f"{path} is no folder", "folder= names a folder that is there")
    return structs.replace(CURRENT, root=path.resolve())


def local_port(
    model: RobotModel,
    conditions: Conditions | None,
    start: Joints | None = None,
    clock: RobotClock | None = None,
) -> LocalPort:
    """A robot of this process within finite limits, with its files in the current folder, unless conditions say
    otherwise.
    """
    given = conditions or Conditions()
    console = Console()
    session = Session(
        console,
        model,
        start=start,
        clock=clock,
        limits=given.limits or Limits(),
        folder=given.folder or CURRENT,
        advice=_advice,
    )
    if given.cell is not None:
        session.driver.surround(given.cell)
    session.driver.inputs = given.inputs
    return LocalPort(session, console)


def _advice(option: str) -> str:
    """Return the advice for a limit that is reached."""
    if option == "signals":
        return "signals= says when inputs change"
    return f"limits=Limits({option}=...) gives it more"


class ProgramFolders(Struct):
    """The folders of the files that programs are from, by the programs' names. `fixed`: programs do not have these."""

    fixed: bool
    _folders: dict[str, Folder] = field(default_factory=dict)

    def put(self, programs: Iterable[str], folder: Path | None) -> None:
        """These programs are from a file in a folder, or from none."""
        for name in programs:
            self._folders.pop(name.lower(), None)
            if folder is not None:
                self._folders[name.lower()] = _folder(folder)

    def conditions(self, program: str, given: Conditions | None) -> Conditions | None:
        """Return the conditions for the run of a program."""
        own = self._folders.get(program.lower())
        if self.fixed or own is None or (given is not None and given.folder is not None):
            return given
        return structs.replace(given or Conditions(), folder=own)
