"""Draw docs/images/rooms.svg: the rooms of the package, and the imports between them.

python -m docs.make_rooms
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
IMAGE = ROOT / "docs" / "images" / "rooms.svg"
WIDTH, HEIGHT = 760, 570
BOX, BASE = (220, 58), (680, 46)  # of a room, and of one that all others import
FONT = "ui-monospace, SFMono-Regular, Menlo, Consolas, 'DejaVu Sans Mono', monospace"
FEWEST = 5  # imports: an arrow of fewer is left out


class Room(NamedTuple):
    """Folders of the package under one name; `x`, `y`: the middle of its box."""

    title: str
    folders: tuple[str, ...]
    x: int
    y: int


ROOMS = (
    Room("front ends", ("cli", "lsp", "highlight", "api", "repl", "render"), 380, 50),
    Room("network", ("net", "bodies", "lab"), 150, 150),
    Room("teaching", ("teach",), 640, 150),
    Room("robot", ("interfaces", "devices"), 440, 230),
    Room("files and wire", ("files", "wire", "convert"), 150, 300),
    Room("cell and body", ("world", "contacts", "twin"), 640, 265),
    Room("language", ("language",), 610, 335),
    Room("motion: f and g", ("engine", "trajectory"), 380, 410),
    Room("values", ("values",), 380, 480),
    Room("geometry", ("kinematics",), 380, 535),
)
UNDER_ALL = ("values", "geometry")


def arrows() -> set[tuple[str, str]]:
    """Which rooms import which others, but for those that all rooms import."""
    room_of = {folder: room.title for room in ROOMS for folder in room.folders}
    found = Counter[tuple[str, str]]()
    for folder, room in room_of.items():
        for path in (ROOT / "vrs_cli" / folder).rglob("*.py"):
            found.update((room, room_of[to]) for to in _imported(path) if room_of.get(to, room) != room)
    return {way for way, count in found.items() if count >= FEWEST and way[1] not in UNDER_ALL}


def _imported(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("vrs_cli."):
            yield str(node.module).split(".")[1]


def picture() -> str:
    """The SVG file."""
    rooms = {room.title: room for room in ROOMS}
    lines = [_line(rooms[a], rooms[b]) for a, b in sorted(arrows())]
    boxes = [_box(room) for room in ROOMS]
    return "\n".join((_HEAD, *lines, *boxes, _SIDES, "</svg>", ""))


def _line(a: Room, b: Room) -> str:
    """From the nearer edge of one box to that of the other."""
    down = BOX[1] / 2 if b.y > a.y else -BOX[1] / 2
    return (
        f'<line x1="{a.x}" y1="{a.y + down:g}" x2="{b.x}" y2="{b.y - down:g}" stroke="#8aa0b4" '
        'stroke-width="2" marker-end="url(#tip)"/>'
    )


def _box(room: Room) -> str:
    width, height = BASE if room.title in UNDER_ALL else BOX
    x, y = room.x - width / 2, room.y - height / 2
    folders = " ".join(f"{folder}/" for folder in room.folders)
    size = 12 if len(folders) < 28 else 7.6
    return (
        f'<rect x="{x:g}" y="{y:g}" width="{width}" height="{height}" rx="6" fill="#ffffff" stroke="#22303c"/>'
        f'<text x="{room.x}" y="{room.y - 6}" font-size="15" font-weight="bold">{room.title}</text>'
        f'<text x="{room.x}" y="{room.y + 15}" font-size="{size}" fill="#4a5a68">{folders}</text>'
    )


_HEAD = (
    f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="{FONT}" '
    'text-anchor="middle">\n'
    f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#f7f9fb"/>\n'
    '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" '
    'markerUnits="userSpaceOnUse" orient="auto"><path d="M0 0L8 4L0 8z" fill="#8aa0b4"/></marker></defs>'
)
_SIDES = (
    '<g font-size="13" fill="#22303c"><path d="M735 60v120m-4 -8l4 8l4 -8" fill="none" stroke="#22303c"/>'
    '<text x="690" y="120">requests</text>'
    '<path d="M20 180v-120m-4 8l4 -8l4 8" fill="none" stroke="#22303c"/><text x="85" y="70">deltas, replies</text></g>'
)

if __name__ == "__main__":
    IMAGE.write_text(picture(), encoding="utf-8")
