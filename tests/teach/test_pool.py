from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from msgspec import structs

from tests.live import until
from vrs_cli.teach import many
from vrs_cli.teach.many import ProcessLimits, work_apart

Deed = Callable[[], object]
SMALL = ProcessLimits(cpu=1.0, wall=20.0, memory=200_000_000, file=1_000_000)
posix = pytest.mark.skipif(os.name == "nt", reason="limits of POSIX systems")


def work(item: str) -> bytes:
    """Do what the item says; return its result and the files in the folder."""
    DEEDS.get(item, bool)()
    return f"{item} {os.listdir('.')}".encode()


def spin() -> None:
    while True:
        pass


def grow() -> None:
    held = [bytearray(10_000_000) for _ in range(1000)]
    assert not held


def fail() -> None:
    raise ValueError("a fault")


def write() -> None:
    Path("mine").write_text("x")


def overflow() -> None:
    with open("large", "wb") as stream:
        stream.write(bytes(2_000_000))


def leave_child() -> None:
    """Start a process that would outlive its parent, and write its number beside the folder, which is removed."""
    left = subprocess.Popen(["sleep", "600"])
    Path("..", "left").write_text(str(left.pid))
    raise ValueError(f"left {left.pid}")


DEEDS: dict[str, Deed] = {
    "spin": spin,
    "grow": grow,
    "fail": fail,
    "write": write,
    "overflow": overflow,
    "die": partial(os.kill, 0, 0),
    "leave": leave_child,
    "stop": partial(time.sleep, 600),
}


def results(items: list[str], jobs: int = 2, limits: ProcessLimits = SMALL) -> dict[str, str]:
    """Return the result of each item, or why it was lost."""
    return {items[one.number]: one.lost or one.result.decode() for one in work_apart(work, items, jobs, limits)}


@pytest.mark.parametrize("jobs", [1, 3])
def test_each_item_has_an_empty_folder_of_its_own(jobs: int) -> None:
    before = os.getcwd()
    items = ["write", "a", "b", "c"]
    assert results(items, jobs) == {"write": "write ['mine']"} | {one: f"{one} []" for one in "abc"}
    assert os.getcwd() == before


@posix
def test_a_process_that_is_ended_costs_its_item_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(DEEDS, "die", lambda: os.kill(os.getpid(), signal.SIGKILL))
    found = results(["a", "spin", "fail", "overflow", "die", "b"])
    assert (found["a"], found["b"]) == ("a []", "b []")
    assert found["spin"] == "it took more than 1 s of the processor"
    assert found["fail"] == "vrs itself failed: ValueError: a fault"
    assert "File too large" in found["overflow"]
    assert found["die"] == "its process was ended by SIGKILL"


def test_objects_that_the_caller_has_frozen_stay_frozen() -> None:
    gc.freeze()
    frozen = gc.get_freeze_count()
    results(["a"])
    assert gc.get_freeze_count() >= frozen * 0.9


@posix
def test_a_process_that_needs_too_much_memory_is_ended() -> None:
    patient = structs.replace(SMALL, cpu=60.0)  # to fill what a large parent has freed takes its time
    assert results(["grow"], limits=patient) == {"grow": "it needed more than 200 MB of memory"}


@posix
def test_the_wall_ends_what_waits() -> None:
    assert results(["stop"], limits=ProcessLimits(wall=0.2)) == {"stop": "it took longer than 0.2 s"}


@posix
def test_no_process_is_left() -> None:
    said = results(["leave"])["leave"]
    number = int(said.rpartition(" ")[2])
    until(lambda: _is_dead(number), "it is ended")


def _is_dead(number: int) -> bool:
    """Return whether a process is gone, or is a zombie."""
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return True
    status = Path(f"/proc/{number}/stat")
    return status.exists() and status.read_text().rpartition(")")[2].split()[0] == "Z"


def test_who_stops_asking_ends_all_processes() -> None:
    found = work_apart(work, ["a", "stop", "stop"], 3, SMALL)
    assert next(found).number == 0
    began = time.monotonic()
    found.close()
    assert time.monotonic() - began < 10.0


def test_a_new_process_does_the_same_where_there_is_no_fork(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(many, "FORK", False)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(sys.path))
    monkeypatch.setattr(sys.modules["__main__"], "__spec__", None, raising=False)  # some kernels and runners have none
    found = {one.number: one.lost or one.result for one in work_apart(_doubled, ["a", "b"], 2, SMALL)}
    assert found == {0: b"aa", 1: b"bb"}


def _doubled(item: str) -> bytes:
    return 2 * item.encode()
