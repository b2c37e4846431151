"""The house: imports between folders point down only, and each third-party package lives where it is said to live."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1] / "vrs_cli"

FLOORS = (  # from the ground up: a folder may import those before it
    "errors",
    "extras",
    "kinematics",
    "trajectory",
    "engine",
    "language",
    "dialogue",
    "files",
    "interfaces",
    "render",
    "repl",
    "highlight",
    "lsp",
    "cli",
    "__main__",
)
LIVES_IN = {
    "lark": {"language/text/parser.py"},
    "prompt_toolkit": {"repl"},
    "rich": {"render"},
    "msgspec": {"engine", "language", "dialogue", "files", "interfaces", "render", "repl", "lsp", "cli"},
    "filelock": {"files/lock.py"},
    "mcap": {"files/mcap_log.py"},
    "matplotlib": {"render"},
    "pygments": {"highlight"},
    "pygls": {"lsp/server.py"},
    "lsprotocol": {"lsp/server.py"},
    "numpy": {"kinematics", "trajectory", "engine", "files", "interfaces/monitor/plotting.py", "render/plots.py"},
}


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
