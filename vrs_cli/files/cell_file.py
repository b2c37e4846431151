"""Read a cell file (option `--cell`): a TOML file with signal names, rules for inputs, and the scene around the robot.

floor = -600                  # [mm] height of the floor in the world; default: the surface on which the robot stands

[signals]
"feeder.go" = 3
"part.there" = 1003

[[follow]]
when = "feeder.go"          # when this signal comes on ("-feeder.go": goes off); a name or a number
set = "part.there"
after = 0.8                 # [s]
lasting = 0.5               # [s] time until the signal changes back; default: it stays

[[follow]]
when = "camera.trigger"
set = "camera.ready"
variables = ["found.x", "found.y"]
rows = [[120.0, 40.5], [80.0, -12.0]]    # values of the variables; each time the next row
again = true                # after the last row begin again with the first

[hand]
opening = 100                 # [mm] distance between the open fingers, which close along the tool's Y
tolerance = 5                 # [mm] maximum distance of the tool's tip from a part that the hand grasps
size = [20, 80, 50]           # [mm] size of the fingers, which end at the tip; sensors detect them
signal = "part.held"          # an input that is on while the hand holds a part

[[part]]
name = "box"
shape = "box"                 # with size; or cylinder: radius, height; sphere: radius; mesh: file, scale
size = [40, 40, 60]
at = [0, 550, -250]           # [mm] position of its centre; O, A, T in degrees may follow
colour = "red"                # or [0.8, 0.1, 0.1]
mass = 0.2                    # [kg]
grasp = [{at = [0, 0, 20], width = 40}]     # grasp points in the part's frame; default: wherever it fits the hand

[[sensor]]
name = "at.feeder"
signal = 1001                 # input to set; -1001: it is on while nothing is detected
kind = "beam"                 # with from, to, radius; or box: at, size; proximity: at, direction, range, radius
from = [-100, 550, -250]
to = [100, 550, -250]

[[feeder]]
when = "feeder.go"            # each time this signal comes on ("-feeder.go": goes off), the next part appears
after = 0.8                   # [s]
parts = ["box", "ring"]       # the parts to supply; they are absent before
at = [0, 550, -250]           # position where parts appear; default: the `at` of each part
again = true                  # after the last part begin again with the first, if it is absent

[[sink]]
when = "belt.go"              # when this signal comes on, parts in the zone that no hand holds disappear
at = [300, 450, -200]
size = [200, 200, 200]
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from vrs_cli.errors import FileDamaged, FileError, did_you_mean
from vrs_cli.extras import shipped_folder
from vrs_cli.files.cell_text import MAX_LENGTH_MM, CellEntry, CellText
from vrs_cli.files.mesh_file import check, convex_pieces
from vrs_cli.files.opening import text_at
from vrs_cli.kinematics.transform import IDENTITY
from vrs_cli.language.run.signals import Cell, Follow
from vrs_cli.language.words.instructions import RESERVED, why_reserved
from vrs_cli.language.words.values import OUTPUTS, STRING_LENGTH
from vrs_cli.values import scene as scenes
from vrs_cli.values.numbers import LIMIT

MAX_BODIES = 5000  # maximum number of parts and fixtures together
MAX_PART_MASS_KG = 1000.0  # [kg] maximum mass of a part
MAX_GRASPS = 20  # maximum number of grasps of one part
# [B] maximum size of one mesh file, and of all mesh files of a cell together
MAX_MESH_FILE_BYTES, MAX_ALL_MESH_BYTES = 10_000_000, 40_000_000
MAX_MESH_POINTS = 200_000  # maximum number of points of all meshes of a cell together
SCENE_KEYS = ("part", "fixture", "sensor", "feeder", "sink", "hand", "floor")

SHAPE_KEYS: Mapping[str, tuple[str, ...]] = {
    "box": ("size",),
    "cylinder": ("radius", "height"),
    "sphere": ("radius",),
    "mesh": ("file", "scale"),
}
SENSOR_KEYS: Mapping[str, tuple[str, ...]] = {
    "beam": ("from", "to", "radius"),
    "box": ("at", "size"),
    "proximity": ("at", "direction", "range", "radius"),
}
COLOURS: Mapping[str, scenes.Colour] = {
    "red": (0.80, 0.15, 0.15),
    "orange": (0.93, 0.52, 0.13),
    "yellow": (0.93, 0.79, 0.18),
    "green": (0.22, 0.60, 0.28),
    "blue": (0.18, 0.39, 0.75),
    "white": (0.95, 0.95, 0.95),
    "grey": (0.60, 0.62, 0.65),
    "black": (0.12, 0.12, 0.12),
}
_BODY_KEYS = ("name", "shape", "at", "colour", *sum(SHAPE_KEYS.values(), ()))
_SENSOR_KEYS = ("name", "signal", "kind", *dict.fromkeys(sum(SENSOR_KEYS.values(), ())))
_NAME = re.compile(r"(?i)[A-Z][A-Z0-9._]{0,63}")
V = TypeVar("V")


class _SceneReader:
    """Reads the scene (floor, parts, fixtures, sensors, hand and so on) from the tables of a cell file. `text` collects
    the mistakes.
    """

    def __init__(self, text: CellText, given: Mapping[str, Any]) -> None:
        self._text, self._given = text, given
        self._names, self._parts, self._fed = {"floor"}, set[str](), set[str]()
        self._meshes: dict[tuple[str, float], scenes.MeshShape] = {}
        self._points = self._bytes = 0
        bodies = sum(len(rows) for key in ("part", "fixture") if isinstance(rows := given.get(key), list))
        if bodies > MAX_BODIES:
            text.fault(text.whole, "part", f"{bodies} parts and fixtures, at most {MAX_BODIES} are read")
            self.scene = scenes.CellScene()
            return
        parts = self._each("part", (*_BODY_KEYS, "mass", "grasp"), self._part)
        fixtures = self._each("fixture", _BODY_KEYS, self._fixture)
        self._parts = {part.name for part in parts}
        self.scene = scenes.CellScene(
            parts,
            fixtures,
            self._each("sensor", _SENSOR_KEYS, self._sensor),
            self._each("feeder", ("when", "after", "parts", "at", "again"), self._feeder),
            self._each("sink", ("when", "after", "at", "size"), self._sink),
            self._gripper(),
            self._floor(),
        )

    def _each(self, key: str, keys: Iterable[str], read: Callable[[CellEntry], V]) -> tuple[V, ...]:
        """Read each table of the array [[key]] with the function `read`. `keys`: the allowed keys."""
        return tuple(map(read, self._text.entries(key, self._given.get(key, []), keys)))

    # --- bodies ---

    def _part(self, entry: CellEntry) -> scenes.ScenePart:
        text, at = self._text, self._text.pose(entry, "at")
        mass = entry.given.get("mass", 0.1)
        if type(mass) not in (int, float) or not 0.0 < mass <= MAX_PART_MASS_KG:
            text.fault(entry, "mass", f"a mass is more than 0 and at most {MAX_PART_MASS_KG:g} kg")
        return scenes.ScenePart(
            self._name(entry), self._shape(entry), at, self._colour(entry, "orange"), mass, self._grasps(entry)
        )

    def _fixture(self, entry: CellEntry) -> scenes.Fixture:
        return scenes.Fixture(
            self._name(entry), self._shape(entry), self._text.pose(entry, "at"), self._colour(entry, "grey")
        )

    def _name(self, entry: CellEntry) -> str:
        given = entry.given.get("name")
        if not isinstance(given, str) or _NAME.fullmatch(given) is None:
            missing = "it is missing: " if given is None else ""
            self._text.fault(
                entry, "name", f"{missing}a letter, then letters, digits, dots and underscores, 64 at most"
            )
            return ""
        name = given.lower()
        if name in self._names:
            self._text.fault(entry, "name", f"{name} is the name of another, choose one of its own")
        self._names.add(name)
        return name

    def _shape(self, entry: CellEntry) -> scenes.Shape:
        """Read the shape of a part or fixture. If it is wrong, report the mistake and return an arbitrary box."""
        text, kind = self._text, self._text.one_of(entry, "shape", SHAPE_KEYS)
        self._refuse_others(entry, kind, SHAPE_KEYS, "shape")
        match kind:
            case "box":
                return scenes.BoxShape(text.size(entry))
            case "cylinder":
                return scenes.CylinderShape(text.length(entry, "radius"), text.length(entry, "height"))
            case "sphere":
                return scenes.SphereShape(text.length(entry, "radius"))
            case "mesh":
                return self._mesh(entry)
        return _UNIT

    def _mesh(self, entry: CellEntry) -> scenes.Shape:
        """Read the mesh that a part or fixture names; each mesh file is read only once."""
        text, file, scale = self._text, entry.given.get("file"), entry.given.get("scale", 1.0)
        if not isinstance(file, str):
            text.fault(entry, "file", "the name of an STL, OBJ or GLB file, beside the cell")
            return _UNIT
        if type(scale) not in (int, float) or not 1e-6 <= scale <= 1e6:
            text.fault(entry, "scale", "a factor from 1e-6 to 1e6")
            return _UNIT
        known = self._meshes.get((file, scale))
        if known is None:
            if self._points > MAX_MESH_POINTS:
                text.fault(entry, "file", f"the meshes before it have {self._points} points, too many to read more")
                return _UNIT
            try:
                self._bytes += check(text.beside(file), min(MAX_MESH_FILE_BYTES, MAX_ALL_MESH_BYTES - self._bytes))
                known = scenes.MeshShape(convex_pieces(text.beside(file), scale), file)
            except FileError as error:
                text.fault(entry, "file", f"{error.detail}" + (f"; {error.hint}" if error.hint else ""))
                return _UNIT
            self._points += sum(map(len, known.pieces))
            self._meshes[file, scale] = known
        if any(abs(x) > MAX_LENGTH_MM / 1000.0 for piece in known.pieces for point in piece for x in point):
            text.fault(entry, "scale", f"the mesh reaches farther than {MAX_LENGTH_MM:g} mm")
        return known

    def _refuse_others(
        self, entry: CellEntry, kind: str | None, table: Mapping[str, tuple[str, ...]], what: str
    ) -> None:
        """Report keys of an entry that only other kinds may have. `table`: the keys of each kind; `what`: "shape" or
        "sensor".
        """
        own = table.get(kind or "", ())
        others = {key for keys in table.values() for key in keys} - {*own, "at"}
        for key in sorted(others & entry.given.keys() if kind else ()):
            self._text.fault(entry, key, f"a {what} of kind {kind} has {', '.join(own)}")

    def _colour(self, entry: CellEntry, default: str) -> scenes.Colour:
        given = entry.given.get("colour", default)
        if isinstance(given, str) and given in COLOURS:
            return COLOURS[given]
        if isinstance(given, list) and len(given) == 3 and all(type(x) in (int, float) and 0 <= x <= 1 for x in given):
            red, green, blue = map(float, given)
            return (red, green, blue)
        self._text.fault(entry, "colour", f"one of {', '.join(COLOURS)}, or [red, green, blue] from 0 to 1")
        return COLOURS[default]

    def _grasps(self, entry: CellEntry) -> tuple[scenes.GraspPlace, ...]:
        given = entry.given.get("grasp", [])
        if not isinstance(given, list) or len(given) > MAX_GRASPS or not all(isinstance(one, dict) for one in given):
            self._text.fault(
                entry, "grasp", f"a list of at most {MAX_GRASPS} places, such as [{{at = [0, 0, 20], width = 40}}]"
            )
            return ()
        found = []
        for one in given:
            inner = CellEntry(f"{entry.name}grasp: ", self._text.lines_from(entry, "grasp"), one)
            self._text.check_keys(inner, ("at", "width"))
            found.append(scenes.GraspPlace(self._text.place(inner, "at"), self._text.length(inner, "width")))
        return tuple(found)

    # --- sensors ---

    def _sensor(self, entry: CellEntry) -> scenes.Sensor:
        text = self._text
        kind = text.one_of(entry, "kind", SENSOR_KEYS)
        self._refuse_others(entry, kind, SENSOR_KEYS, "sensor")
        region: scenes.Beam | scenes.Zone | scenes.Proximity = scenes.Zone(IDENTITY, (1.0, 1.0, 1.0))
        match kind:
            case "beam":
                region = scenes.Beam(
                    text.place(entry, "from"), text.place(entry, "to"), text.length(entry, "radius", 0.5)
                )
            case "box":
                region = scenes.Zone(text.pose(entry, "at"), text.size(entry))
            case "proximity":
                way, far = text.direction(entry, "direction"), text.length(entry, "range")
                region = scenes.Proximity(text.place(entry, "at"), way, far, text.length(entry, "radius", 0.5))
        name = entry.given.get("name")
        if not isinstance(name, str) or _NAME.fullmatch(name) is None:
            text.fault(entry, "name", "a name, such as at.feeder")
            name = ""
        signal = text.input_signal(entry, "signal") or 0
        text.claim(entry, "signal", signal)
        return scenes.Sensor(name.lower(), signal, region)

    # --- feeders and sinks ---

    def _feeder(self, entry: CellEntry) -> scenes.Feeder:
        text, given = self._text, entry.given.get("parts")
        if not isinstance(given, list) or not given or not all(isinstance(one, str) for one in given):
            text.fault(entry, "parts", 'a list of names of parts, such as ["box", "ring"]')
            given = []
        parts = tuple(one.lower() for one in given)
        for name in parts:
            if name not in self._parts:
                near = did_you_mean(name[:80], self._parts, "each is the name of a [[part]]")
                text.fault(entry, "parts", f"no part is called {name[:80]} ({near})")
            elif name in self._fed:
                text.fault(entry, "parts", f"{name} is fed already; each part comes once in one list")
            self._fed.add(name)
        at = text.pose(entry, "at") if "at" in entry.given else None
        when, after = text.signal(entry, "when") or 0, text.seconds(entry, "after") or 0.0
        return scenes.Feeder(parts, when, after, at, text.switch(entry, "again"))

    def _sink(self, entry: CellEntry) -> scenes.PartSink:
        text = self._text
        zone = scenes.Zone(text.pose(entry, "at"), text.size(entry))
        return scenes.PartSink(text.signal(entry, "when") or 0, zone, text.seconds(entry, "after") or 0.0)

    # --- hand and floor ---

    def _gripper(self) -> scenes.Gripper:
        text, given = self._text, self._given.get("hand", {})
        if not isinstance(given, dict):
            text.fault(text.whole, "hand", "write [hand], and below it opening = 100")
            return scenes.Gripper()
        entry = text.entry("hand", given, ("opening", "tolerance", "size", "signal"))
        plain = scenes.Gripper()
        signal = (text.input_signal(entry, "signal") or 0) if "signal" in given else 0
        text.claim(entry, "signal", signal)
        return scenes.Gripper(
            text.length(entry, "opening") if "opening" in given else plain.opening,
            text.length(entry, "tolerance", 1e3 * plain.tolerance),
            text.size(entry) if "size" in given else plain.size,
            signal,
        )

    def _floor(self) -> float | None:
        given = self._given.get("floor")
        if given is None:
            return None
        if type(given) not in (int, float) or not abs(given) <= MAX_LENGTH_MM:
            self._text.fault(self._text.whole, "floor", f"a height from -{MAX_LENGTH_MM:g} to {MAX_LENGTH_MM:g} mm")
            return None
        return float(given) / 1000.0


_UNIT = scenes.BoxShape((1.0, 1.0, 1.0))  # stands for a shape that has mistakes


KEYS = ("when", "set", "after", "lasting", "variables", "rows", "again")
TABLES = ("signals", "follow", *SCENE_KEYS)
MAX_CELL_CHARS = 2_000_000  # maximum size of a cell file
# names of real and string variables: NAME in grammar/val2.lark, without the names of locations
_VARIABLE = re.compile(r"(?i)\$?[A-Z][A-Z0-9._]*")


def read_cell(path: str) -> Cell:
    """Read a cell file, and the mesh files that it names. `path`: a path, or the name of a sample that comes with vrs
    (`pick_and_place`). Raises NonexistentFile, and FileDamaged with the line of each mistake.
    """
    if not Path(path).exists() and Path(path).name == path:
        sample = Path(shipped_folder("programs"), f"{path.removesuffix('.toml')}.toml")
        path = str(sample) if sample.is_file() else path
    return parse_cell(text_at(path, MAX_CELL_CHARS), path)


def parse_cell(text: str, path: str = "cell") -> Cell:
    """Read a cell from the content of its file. `path`: the file's name in errors. Raises FileDamaged with the line of
    each mistake.
    """
    if len(text) > MAX_CELL_CHARS:
        raise FileDamaged(f"{path}: {len(text)} characters", f"at most {MAX_CELL_CHARS} are read")
    try:
        given = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise FileDamaged(f"{path}: {str(error)[:500]}", f"a cell is a TOML file: {_KNOWN}") from None
    reader = CellText(path, text)
    for key in sorted(given.keys() - set(TABLES)):
        reader.fault(reader.whole, key, did_you_mean(key[:80], TABLES, f"there are {_KNOWN}"))
    signals = given.get("signals", {})
    if isinstance(signals, dict):
        reader.name_signals(signals)
    else:
        reader.fault(reader.whole, "signals", "write [signals], and below it part.there = 1003")
    follows = [_follow(reader, entry) for entry in reader.entries("follow", given.get("follow", []), KEYS)]
    scene = _SceneReader(reader, given).scene
    if reader.wrong:
        raise FileDamaged("\n".join(reader.wrong), f"there are {_KNOWN}")
    names = {number: name for name, number in reader.names.items()}
    return Cell(names, tuple(rule for rule in follows if rule is not None), scene)


_KNOWN = "[signals], [[follow]], [[part]], [[fixture]], [[sensor]], [[feeder]], [[sink]], [hand] and floor"


def _follow(text: CellText, entry: CellEntry) -> Follow | None:
    """Read one table [[follow]], a rule for an input signal. If it is wrong, report the mistakes and return None."""
    rule, mistakes = entry.given, len(text.wrong)
    when = text.signal(entry, "when")
    sets = text.signal(entry, "set") if "set" in rule else None
    after, lasting = (text.seconds(entry, key) for key in ("after", "lasting"))
    variables, rows = _table(text, entry)
    again = text.switch(entry, "again")
    if sets is not None and abs(sets) in OUTPUTS:
        text.fault(entry, "set", "an output is the program's; an input or an internal signal follows")
    if "set" not in rule and not {"variables", "rows"} & rule.keys():
        text.fault(entry, "set", "nothing follows: it needs set, or variables and rows")
    if len(text.wrong) > mistakes or when is None:
        return None
    return Follow(when, sets, after or 0.0, lasting, variables, rows, again)


def _table(text: CellText, entry: CellEntry) -> tuple[tuple[str, ...], tuple[tuple[float | str, ...], ...]]:
    """Read the keys `variables` and `rows` of a rule: names of variables, and the rows of values that they get one
    after the other.
    """
    rule = entry.given
    variables, rows = rule.get("variables", []), rule.get("rows", [])
    if not (isinstance(variables, list) and all(isinstance(one, str) for one in variables)):
        text.fault(entry, "variables", "a list of names, such as x, or $name for a string")
        return (), ()
    for name in variables:
        if wrong := _wrong_variable(name):
            text.fault(entry, "variables", wrong)
    if not (isinstance(rows, list) and all(isinstance(row, list) for row in rows)):
        text.fault(entry, "rows", "a list of rows, each a list of values")
        return (), ()
    if not variables or not rows:
        if {"variables", "rows"} & rule.keys():
            text.fault(entry, "rows" if variables else "variables", "variables and rows belong together")
        return (), ()
    for number, row in enumerate(rows, 1):
        if len(row) != len(variables) or not all(map(_fits, variables, row)):
            text.fault(entry, "rows", f"row {number}: a value for each of {', '.join(variables)} is wanted")
            return (), ()
    return tuple(variables), tuple(tuple(one if isinstance(one, str) else float(one) for one in row) for row in rows)


def _wrong_variable(name: str) -> str:
    """Return the reason why a real or string variable cannot have this name; "" if it can."""
    if _VARIABLE.fullmatch(name) is None:
        return f"{name!r} is no name of a real, as found.x is, or of a string, as $kind is"
    if name.upper() in RESERVED:
        reason, hint = why_reserved(name.upper())
        return f"{reason}: {hint}"
    return ""


def _fits(variable: str, value: Any) -> bool:
    if variable.startswith("$"):
        return isinstance(value, str) and len(value) <= STRING_LENGTH
    return type(value) in (int, float) and abs(value) <= LIMIT
