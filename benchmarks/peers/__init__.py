"""The tools that a user would pick instead, each measured in an environment of its own, in the same run as we are.

An environment is made in `.peers/` when it is first needed, and made again after a change of a package that lies in a
folder. A peer that cannot be installed is named and left out. The module `benchmarks.peers.<name>` runs inside it: it
reads its work as JSON and prints its figures as JSON.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
ENVIRONMENTS = ROOT / ".peers"
INSTALLING = 900  # [s] at most
WORKING = 300  # [s] at most
# installed packages come before those of our folder, of which only `benchmarks` is wanted
RUN = (
    "import runpy, sys; sys.path[0] = ''; sys.path.append(sys.argv[1]); runpy.run_module(sys.argv[2], None, '__main__')"
)


@dataclass(frozen=True)
class Figures:
    """What a peer needs [us], by kind of work."""

    title: str
    values: dict[str, float]


@dataclass(frozen=True)
class Peer:
    """`name` is the module of this package that measures it."""

    name: str
    title: str
    packages: tuple[str, ...]


PEERS = {
    peer.name: peer
    for peer in (
        Peer("eaik_peer", "EAIK", ("eaik", "numpy")),
        Peer("toolbox_peer", "Robotics Toolbox", ("roboticstoolbox-python", "numpy")),
        Peer("pinocchio_peer", "Pinocchio", ("pin", "numpy")),
        Peer("ruckig_peer", "Ruckig", ("ruckig",)),
        Peer("toppra_peer", "TOPP-RA", ("toppra", "numpy")),
        Peer("scipy_peer", "scipy PPoly", ("scipy", "numpy")),
        Peer("compiled_vrs", "vrs with compiled modules", (str(ROOT),)),
    )
}


class PeerMissing(Exception):
    """A peer that cannot be measured here; the message says why."""


class Peers:
    """Measures peers; `missing` says why some are not there."""

    def __init__(self) -> None:
        self.missing: list[str] = []

    def figures(self, name: str, work: dict[str, Any]) -> Figures:
        """What a peer needs for this work; nothing where it is missing."""
        try:
            return Figures(PEERS[name].title, measure(name, work))
        except PeerMissing as error:
            self.missing.append(str(error))
            return Figures(PEERS[name].title, {})


def beside(kind: str, *figures: Figures) -> dict[str, float]:
    """What each peer needs for one kind of work, by its title; those that do not do it are left out."""
    return {each.title: each.values[kind] for each in figures if kind in each.values}


def measure(name: str, work: dict[str, Any]) -> dict[str, float]:
    """What a peer needs for this work [us]. Raises PeerMissing."""
    python = environment(name)
    command = [str(python), "-c", RUN, str(ROOT), f"benchmarks.peers.{name}"]
    try:
        done = subprocess.run(
            command,
            cwd=ENVIRONMENTS,
            input=json.dumps(work),
            text=True,
            capture_output=True,
            timeout=WORKING,
            check=True,
        )
        figures: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    except subprocess.CalledProcessError as error:
        raise PeerMissing(f"{PEERS[name].title} failed: {_last_line(error.stderr)}") from None
    except subprocess.TimeoutExpired:
        raise PeerMissing(f"{PEERS[name].title} took more than {WORKING} s") from None
    return figures


@cache
def environment(name: str) -> Path:
    """The interpreter of a peer's environment, made where it is not there yet. Raises PeerMissing."""
    peer, folder = PEERS[name], ENVIRONMENTS / name
    python = folder / "bin" / "python"
    ready = folder / "ready"
    if ready.is_file() and ready.stat().st_mtime >= max(map(_changed, peer.packages)):
        return python
    print(f"installing {peer.title} (once) ...", file=sys.stderr, flush=True)
    try:
        _quietly([sys.executable, "-m", "venv", "--clear", str(folder)])
        _quietly([str(python), "-m", "pip", "install", "--quiet", *peer.packages])
    except subprocess.CalledProcessError as error:
        raise PeerMissing(f"{peer.title} cannot be installed here: {_last_line(error.stderr)}") from None
    except subprocess.TimeoutExpired:
        raise PeerMissing(f"{peer.title} cannot be installed here in {INSTALLING} s") from None
    ready.touch()
    return python


def _quietly(command: list[str]) -> None:
    environment = {**os.environ, "VRS_COMPILED": "1"}  # of which only the build of vrs takes notice
    subprocess.run(command, capture_output=True, text=True, timeout=INSTALLING, check=True, env=environment)


def _changed(package: str) -> float:
    """Return when a package in a folder was last changed, by the clock of its files; 0 for a name."""
    files = (*Path(package).glob("vrs_cli/**/*.py"), Path(package, "pyproject.toml"))
    return max((file.stat().st_mtime for file in files if file.is_file()), default=0.0)


def _last_line(text: str) -> str:
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1] if lines else "no reason given"
