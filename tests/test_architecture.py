"""The house: imports point down only, in circles never, and each third-party package lives where it is said to live."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parents[1] / "vrs_cli"

FLOORS = (  # from the ground up: a folder may import those before it
    "version",
    "errors",
    "extras",
    "kinematics",
    "trajectory",
    "engine",
    "language",
    "dialogue",
    "wire",
    "files",
    "interfaces",
    "net",
    "render",
    "view3d",
    "repl",
    "api",
    "highlight",
    "lsp",
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
        "holders",
        "conversation",
        "roles",
    ),
}
LIVES_IN = {
    "lark": {"language/text/table.py"},
    "prompt_toolkit": {"repl"},
    "websockets": {"net/client.py", "net/server.py", "net/sockets.py", "view3d/guard.py"},
    "rich": {"render", "view3d/app.py", "view3d/studio.py"},
    "viser": {"view3d"},
    "trimesh": {"view3d/mesh_files.py"},
    "PIL": {"view3d/still.py"},
    "msgspec": {*FLOORS[FLOORS.index("engine") :]},  # but see `test_bytes_are_made_and_read_in_one_room`
    "filelock": {"files/lock.py"},
    "mcap": {"files/mcap_log.py"},
    "xacro": {"kinematics/urdf/macros.py"},
    "nats": {"net/nats.py"},
    "matplotlib": {"render"},
    "pygments": {"highlight"},
    "pygls": {"lsp/server.py"},
    "lsprotocol": {"lsp/server.py"},
    "numpy": {
        *("kinematics", "trajectory", "engine", "files", "view3d", "api"),
        *("interfaces/monitor/plotting.py", "interfaces/roles", "net/experiment.py", "render/plots.py"),
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
        ("cli",), ("vrs_cli", "time", "collections"), "a command loads what it needs, and its help nothing of that"
    ),
    Deferred(("cli/serve.py",), ("asyncio", "ssl", "tempfile"), "as above"),
    Deferred(("cli/fence.py",), ("resource",), "Windows has none"),
    Deferred(
        ("repl", "render"),
        ("vrs_cli", "prompt_toolkit.utils", "rich"),
        "the first prompt stands before what the first line needs is loaded",
    ),
    Deferred(("repl/echo.py",), ("termios",), "Windows has none"),
    Deferred(("files/atomic.py",), ("fcntl",), "Windows has none"),
    Deferred(("files/lock.py",), ("filelock",), "most runs write nothing"),
    Deferred(("files/mcap_log.py",), ("mcap",), "mcap is an extra"),
    Deferred(("kinematics/urdf/macros.py",), ("xacro",), "xacro is an extra"),
    Deferred(("files/store.py",), ("vrs_cli.language.text.printer",), "most runs store no program"),
    Deferred(("errors.py",), ("difflib",), "only mistakes need it"),
    Deferred(
        ("files/atomic.py", "files/disk.py", "files/folder.py"), ("tempfile", "shutil"), "most runs write nothing"
    ),
    Deferred(("cli/check.py", "cli/run.py"), ("json",), "only --json needs it"),
    Deferred(("language/text/table.py",), ("lark",), "the table that lark makes is kept between runs"),
    Deferred(
        (
            *("kinematics", "trajectory", "engine", "files"),
            *("interfaces/monitor/plotting.py", "interfaces/roles", "net/experiment.py", "render/plots.py"),
        ),
        ("numpy", "vrs_cli.kinematics.arrays"),
        "numpy takes longer to load than a short program runs, and one position needs none of it",
    ),
    Deferred(
        ("kinematics", "engine"),
        (
            "vrs_cli.engine.continuation",
            "vrs_cli.kinematics.mapped_batch",
            "vrs_cli.kinematics.numeric",
            "vrs_cli.kinematics.offset_wrist.batch",
            "vrs_cli.kinematics.parallel_axes.batch",
            "vrs_cli.kinematics.serial_batch",
            "vrs_cli.kinematics.spherical_wrist.batch",
            "vrs_cli.kinematics.transform_batch",
            "vrs_cli.trajectory.path_batch",
        ),
        "they bring numpy",
    ),
    Deferred(("files/trajectory_file.py",), ("vrs_cli.files.soundness",), "it brings numpy"),
    Deferred(
        ("view3d/pictures.py", "api/scene.py"),
        ("vrs_cli.view3d.page", "vrs_cli.view3d.still"),
        "viser takes half a second to load",
    ),
    Deferred(("kinematics/forms.py",), ("vrs_cli.kinematics",), "a robot loads its own closed form, and no other"),
    Deferred(
        ("kinematics/model.py", "kinematics/model_data.py"),
        ("vrs_cli.kinematics.shapes", "vrs_cli.kinematics.shape_data"),
        "a robot is seldom looked at, and its own shapes have few",
    ),
    Deferred(("kinematics/robot_file.py",), ("vrs_cli.kinematics.urdf",), "it brings an XML parser, which few need"),
)


def modules() -> list[Path]:
    return sorted(path for path in ROOT.rglob("*.py") if path.name != "__init__.py")


def imported(path: Path) -> Iterator[str]:
    """The modules that a file imports anywhere, but for type checking too: a layer is a layer."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            assert node.level == 0, f"{path}: relative import"
            yield node.module


def floor_of(name: str) -> int:
    return FLOORS.index(name)


def room_of(path: Path) -> str:
    inside = path.relative_to(ROOT)
    return inside.parts[0] if len(inside.parts) > 1 else inside.stem


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_point_down(path: Path) -> None:
    here = floor_of(room_of(path))
    for module in imported(path):
        parts = module.split(".")
        if parts[0] == "vrs_cli" and len(parts) > 1:
            assert floor_of(parts[1]) <= here, f"{room_of(path)} imports {module}"


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(ROOT)))
def test_third_party_packages_live_in_one_place(path: Path) -> None:
    inside = path.relative_to(ROOT).as_posix()
    for module in imported(path):
        package = module.split(".")[0]
        if package == "vrs_cli" or package in sys.stdlib_module_names:
            continue
        assert package in LIVES_IN, f"{inside} imports {package}, which has no home"
        homes = LIVES_IN[package]
        assert any(inside == home or inside.startswith(home + "/") for home in homes), f"{inside} imports {package}"


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(ROOT)))
def test_bytes_are_made_and_read_in_one_room(path: Path) -> None:
    """Of msgspec every floor may have the base class of its values; encoders and decoders are wire's alone."""
    if room_of(path) == "wire":
        return
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            assert not any(alias.name.startswith("msgspec") for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module == "msgspec":
            assert {alias.name for alias in node.names} <= {"Struct", "field", "structs"}
        elif isinstance(node, ast.ImportFrom):
            assert not str(node.module).startswith("msgspec.") or node.module == "msgspec.structs"


# --- circles and imports out of place ------------------------------------------------------------------------------


def name_of(path: Path) -> str:
    return ".".join(("vrs_cli", *path.relative_to(ROOT).with_suffix("").parts)).removesuffix(".__init__")


def imports_among(names: set[str], path: Path) -> set[str]:
    """The modules of `names` that a file imports anywhere: `from folder import module` is an import of the module."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names} & names
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            inner = {f"{node.module}.{alias.name}" for alias in node.names} & names
            found |= inner or {node.module} & names
    return found


def test_inner_floors_point_down() -> None:
    for folder, floors in INNER_FLOORS.items():
        for path in (ROOT / folder).rglob("*.py"):
            here = path.relative_to(ROOT).parts[1]
            for module in imported(path):
                parts = module.split(".")
                if here in floors and parts[:2] == ["vrs_cli", folder] and parts[2] in floors:
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
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef) or (isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)):
            for child in ast.walk(node):
                if isinstance(child, ast.Import):
                    found |= {alias.name for alias in child.names}
                elif isinstance(child, ast.ImportFrom) and child.module is not None:
                    below = {f"{child.module}.{alias.name}" for alias in child.names}
                    found |= below if child.module.count(".") == 1 else {child.module}
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
