"""The memory of one robot, with its programs ready to run."""

from __future__ import annotations

from vrs_cli.kinematics.joints import TURNING, JointUnits
from vrs_cli.language.run.executable import Executable
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.run.programs import StoredProgram


class Environment(Memory):
    """Each program is compiled once, when it first runs, and again when another is stored in its place."""

    def __init__(self, seed: int = 0, units: JointUnits = TURNING) -> None:
        super().__init__(seed, units)
        self._executables: dict[str, Executable] = {}

    def executable(self, stored: StoredProgram) -> Executable:
        """A program of the memory, ready to run."""
        known = self._executables.get(stored.program.key)
        if known is None or known.stored is not stored:
            known = self._executables[stored.program.key] = Executable(self, stored)
        return known

    def held(self) -> int:
        """Elements of all arrays, and characters of all strings, those of LOCAL too."""
        known = (one for key, one in self._executables.items() if self.programs.get(key) is one.stored)
        return self.size() + sum(one.held() for one in known)
