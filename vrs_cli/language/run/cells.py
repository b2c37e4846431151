"""Where variables live: cells of one kind, plain dictionaries that compiled programs read and write directly.

Two rules hold at all times: a bare name is a real or a transformation, never both, and a cell that is not there is
undefined, so that reading it says so by itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import repeat
from typing import Any, NamedTuple, NoReturn, cast
from weakref import ref

from vrs_cli.errors import IllegalArrayIndex, TypeMismatch, UndefinedValue, nearest
from vrs_cli.language.words.values import Kind, kind_of_value, storable, whole
from vrs_cli.values.numbers import Value

Index = int | tuple[int, ...]
Item = tuple[str, Index | None]  # a variable by its key, an element of an array by its index, too

OTHER_KIND = {Kind.REAL: Kind.LOCATION, Kind.LOCATION: Kind.REAL}


def closest(key: str, names: Mapping[str, str]) -> str:
    """`did you mean X?` for a key that is not there, or nothing. `names`: key to spelling."""
    near = nearest(key, names, 0.7)
    return f"did you mean {names[near]}?" if near else ""


def subscript(index: Index) -> str:
    """`3` or `1,2`."""
    return ",".join(map(str, index)) if isinstance(index, tuple) else str(index)


class Cells(dict[str | Index, Value]):
    """Values of one kind: all simple variables of that kind by key, or the elements of one `array` by index.

    Reading what is not there raises UndefinedValue, TypeMismatch or IllegalArrayIndex. `spelling`: how names were first
    typed, by key. `others`: the cells of the other kind that a bare name can have. `omitted` names the parameter whose
    argument a CALL left out, in the cells made to stand for it. `changed`: where changes are noted, if they are.
    """

    __slots__ = ("__weakref__", "array", "changed", "kind", "omitted", "others", "spelling")

    def __init__(
        self, spelling: Mapping[str, str], kind: Kind, array: str | None = None, omitted: str | None = None
    ) -> None:
        super().__init__()
        self.spelling = spelling
        self.kind = kind
        self.array = array
        self.omitted = omitted
        self.others: ref[Cells] | None = None  # a cycle of the two would stay in the memory of a server
        self.changed: set[Item] | None = None

    def note_changes(self, changed: set[Item] | None) -> None:
        """Add every variable that changes from now on to a set; with None, note nothing."""
        self.changed = changed
        self.__class__ = Cells if changed is None else NotedCells

    def __missing__(self, key: str | Index) -> Value:
        if self.omitted is not None:
            raise UndefinedValue(self.omitted, "its argument was left out of the CALL")
        if self.array is not None and not isinstance(key, str):
            self.rounded(key if isinstance(key, tuple) else (key,))
        others = None if self.others is None else self.others()
        if others is not None and key in others:
            self.deny(key)
        simple = self if self.array is None and isinstance(key, str) else ()
        raise UndefinedValue(self.name(key), closest(str(key), {str(name): self.name(name) for name in simple}))

    def take(self, values: Mapping[str | Index, Value]) -> None:
        """Give many variables their values."""
        self.update(values)

    def size(self) -> int:
        """Elements of an array, and characters of strings."""
        elements = 0 if self.array is None else len(self)
        if self.kind is not Kind.STRING:
            return elements
        return elements + sum(len(value) for value in self.values() if isinstance(value, str))

    def name(self, key: str | Index) -> str:
        """The variable as a listing shows it: `part`, `#safe`, `row[3]`."""
        if self.array is None:
            return self.spelling.get(str(key), str(key))
        spelling = self.spelling.get(self.array, self.array)
        return f"{spelling}[{'' if isinstance(key, str) else subscript(key)}]"

    def deny(self, key: str | Index) -> NoReturn:
        """Raise TypeMismatch for a bare name that exists as the other kind. Compiled programs call it too."""
        other = OTHER_KIND[self.kind]
        raise TypeMismatch(f"{self.name(key)} is a {other.value}", f"a {self.kind.value} is wanted here")

    def at(self, *indexes: float) -> Index:
        """The index of an element to be assigned, rounded. Raises IllegalArrayIndex below 0."""
        rounded = self.rounded(indexes)
        return rounded if len(rounded) > 1 else rounded[0]

    def rounded(self, indexes: Iterable[float]) -> tuple[int, ...]:
        """Raises IllegalArrayIndex below 0."""
        rounded = tuple(map(whole, indexes))
        if min(rounded) < 0:
            raise IllegalArrayIndex(self.name(rounded), "indexes begin at 0")
        return rounded

    def item(self, key: str | Index) -> Item:
        """The variable whose value is under a key."""
        return (str(key), None) if self.array is None else (self.array, cast(Index, key))


class NotedCells(Cells):
    """Cells that note which variables change. They are slower to write, so that programs run on plain ones."""

    __slots__ = ()

    def __setitem__(self, key: str | Index, value: Value) -> None:
        if self.get(key) != value:
            self._note(key)
        super().__setitem__(key, value)

    def take(self, values: Mapping[str | Index, Value]) -> None:
        old = self.get
        keys = [key for key, value in values.items() if old(key) != value]
        items = zip(keys, repeat(None)) if self.array is None else zip(repeat(self.array), keys)
        if self.changed is not None:
            self.changed.update(cast(Iterable[Item], items))
        super().take(values)

    def pop(self, key: str | Index, default: Any = None) -> Any:
        if key in self:
            self._note(key)
        return super().pop(key, default)

    def clear(self) -> None:
        for key in self:
            self._note(key)
        super().clear()

    def _note(self, key: str | Index) -> None:
        if self.changed is not None:
            self.changed.add(self.item(key))


def bare_cells(
    spelling: Mapping[str, str], array: str | None = None, omitted: str | None = None
) -> tuple[Cells, Cells]:
    """The reals and the transformations that bare names can be."""
    reals = Cells(spelling, Kind.REAL, array, omitted)
    locations = Cells(spelling, Kind.LOCATION, array, omitted)
    reals.others, locations.others = ref(locations), ref(reals)
    return reals, locations


class SubArray(Cells):
    """Part of an array: the elements whose indexes begin with `before`, under the indexes that follow."""

    __slots__ = ("_before", "_whole")

    def __init__(self, whole_array: Cells, before: tuple[int, ...]) -> None:
        super().__init__(whole_array.spelling, whole_array.kind, whole_array.array, whole_array.omitted)
        self._whole, self._before = whole_array, before

    def _index(self, key: str | Index) -> str | Index:
        return key if isinstance(key, str) else self._before + (key if isinstance(key, tuple) else (key,))

    def __getitem__(self, key: str | Index) -> Value:
        return self._whole[self._index(key)]

    def __setitem__(self, key: str | Index, value: Value) -> None:
        self._whole[self._index(key)] = value

    def __contains__(self, key: object) -> bool:
        return isinstance(key, str | int | tuple) and self._index(key) in self._whole

    def __iter__(self) -> Iterator[str | Index]:
        size = len(self._before)
        for index in list(self._whole):
            if isinstance(index, tuple) and len(index) > size and index[:size] == self._before:
                yield index[size] if len(index) == size + 1 else index[size:]

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def name(self, key: str | Index) -> str:
        """The element as the whole array names it."""
        if isinstance(key, str):
            return self._whole.name(self._before).replace("]", ",]")
        return self._whole.name(self._index(key))


NO_CELLS = Cells({}, Kind.LOCATION)  # where a `#` or `$` name can have no other kind


class Reference(NamedTuple):
    """Where a variable lives, so that it can be passed on and assigned: an argument of CALL, HERE, PROMPT ...

    `cells` are those of its kind. A bare name may still be of two kinds: `cells` are the reals, `locations` the
    transformations; for `#` and `$` names `locations` is empty. `key` is None for a whole array.
    """

    cells: Cells
    locations: Cells
    key: str | Index | None

    @property
    def name(self) -> str:
        return self.cells.name("" if self.key is None else self.key)

    def defined(self) -> bool:
        """Whether the variable, or any element of the array, has a value."""
        if self.key is None:
            return bool(self.cells or self.locations)
        return self.key in self.cells or self.key in self.locations

    def value(self) -> Value:
        """The value, whichever kind it is. Raises UndefinedValue."""
        key = self._cell()
        return self.locations[key] if key in self.locations else self.cells[key]

    def assign(self, value: Value) -> None:
        """Raises TypeMismatch where the name exists as another kind, IllegalArrayIndex for an index below 0."""
        key = self._cell()
        kind = kind_of_value(value)
        to_location = kind is Kind.LOCATION and self.cells.kind is Kind.REAL
        mine, other = (self.locations, self.cells) if to_location else (self.cells, self.locations)
        if mine.kind is not kind:
            wanted = "real or a transformation" if self.cells.kind is Kind.REAL else self.cells.kind.value
            raise TypeMismatch(f"{self.name} cannot hold a {kind.value}", f"a {wanted} is wanted")
        if key in other:
            mine.deny(key)
        if not isinstance(key, str):
            self.cells.rounded(key if isinstance(key, tuple) else (key,))
        mine[key] = storable(value) if isinstance(value, str) else value

    def row(self, *indexes: float) -> Reference:
        """The elements of an array whose indexes begin with these: `a[i,]`. Raises IllegalArrayIndex."""
        before = self.cells.rounded(indexes)
        locations = self.locations if self.locations is NO_CELLS else SubArray(self.locations, before)
        return Reference(SubArray(self.cells, before), locations, None)

    def size(self) -> int:
        """Elements of an array, and characters of strings."""
        return self.cells.size() + self.locations.size()

    def _cell(self) -> str | Index:
        if self.key is None:
            raise IllegalArrayIndex(self.name, "one element is wanted, not the whole array")
        return self.key


def new_variable(
    spelling: Mapping[str, str], key: str, kind: Kind, *, array: bool = False, omitted: str | None = None
) -> Reference:
    """A variable without a value, in cells of its own. One whose `kind` is REAL can become a transformation."""
    name, place = (key, None) if array else (None, key)
    if kind is Kind.REAL:
        return Reference(*bare_cells(spelling, name, omitted), place)
    return Reference(Cells(spelling, kind, name, omitted), NO_CELLS, place)
