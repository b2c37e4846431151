"""What a program finds in memory: variables that have a value, other programs, and the names that these give one.

Made once for all programs of a file: whatever is asked of it about one program costs no walk through the others.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from functools import cached_property

from vrs_cli.language.analysis.names import declares, own_variables
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program
from vrs_cli.language.text.meaning import variables_given_by
from vrs_cli.language.words.values import NAME_LENGTH, Kind
from vrs_cli.values.diagnostics import did_you_mean

FEW = 200  # names: a word is compared with each of them; of more, with those one slip of the fingers away


class Surroundings:
    """`known`: the kinds of the variables that have a value. `programs`: those in memory, by key."""

    def __init__(self, known: Mapping[str, Kind], programs: Mapping[str, Program]) -> None:
        self.known, self.programs = known, programs

    @cached_property
    def program_keys(self) -> tuple[str, ...]:
        return tuple(self.programs)

    @cached_property
    def given(self) -> frozenset[str]:
        """The keys of all names that programs give a value."""
        return frozenset(self._givers)

    @cached_property
    def _givers(self) -> Counter[str]:
        """How many programs give each name a value."""
        return Counter(key for program in self.programs.values() for key in names_given_in(program))

    def given_elsewhere(self, key: str, program: Program) -> bool:
        """Whether another program gives a name a value."""
        here = self.programs.get(program.key)
        return self._givers[key] > (here is not None and key in names_given_in(here))

    # --- what a word may have been meant for ---

    def name_meant(self, variable: ast.Variable, own: Candidates) -> str:
        """Return `did you mean name?` with a name of the program or of memory that has the same sigil, or ""."""
        near = (*own.of(variable.key), *self._names_alike.of(variable.key))
        alike = (key for key in near if key[0] == variable.key[0] or not (variable.sigil or key[0] in "#$"))
        return did_you_mean(variable.key, alike)

    def program_meant(self, name: str) -> str:
        """`did you mean name?`, or ""."""
        near = self._programs_alike.of(name.lower()[:NAME_LENGTH])
        return did_you_mean(name, [self.programs[key].name for key in near])

    @cached_property
    def _names_alike(self) -> Candidates:
        return Candidates(self.given | self.known.keys())

    @cached_property
    def _programs_alike(self) -> Candidates:
        return Candidates(self.program_keys)


class Candidates:
    """Names that a mistyped one may have meant."""

    def __init__(self, names: Collection[str]) -> None:
        self._names = names

    def of(self, name: str) -> Collection[str]:
        """Return the names to compare with: all where they are few, otherwise those one slip of the fingers away."""
        if len(self._names) <= FEW:
            return self._names
        return dict.fromkeys(near for rest in _rests(name) for near in self._by_rest.get(rest, ()))

    @cached_property
    def _by_rest(self) -> Mapping[str, list[str]]:
        found: dict[str, list[str]] = {}
        for name in sorted(self._names):
            for rest in _rests(name):
                found.setdefault(rest, []).append(name)
        return found


def _rests(name: str) -> list[str]:
    """A name, and what is left of it without one letter: names that share one are a slip of the fingers apart."""
    return list(dict.fromkeys((name, *(name[:i] + name[i + 1 :] for i in range(len(name))))))


# --- the names that a program gives a value to -------------------------------------------------------------------


def names_given_in(program: Program) -> frozenset[str]:
    """Return the keys of all variables that a program gives a value, by itself or through a CALL."""
    remembered = vars(program)  # of the program itself: a cache of this module would keep deleted programs in memory
    if "names_given" not in remembered:
        own = {own.key for own in own_variables(program)} | {one.key for one in program.parameters}
        doing = (one for one in program.statements if not declares(one))
        remembered["names_given"] = frozenset(key for one in doing for key in variables_given_by(one)) - own
    found: frozenset[str] = remembered["names_given"]
    return found
