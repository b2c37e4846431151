"""Plans by the modules that are compiled to C, compared with plans by their Python sources.

`python -m tests.laws.compiled_lines LINES [FIRST]` plans a straight line and a joint motion for each seed, in two
processes, and prints each seed whose plans or errors differ in any bit; status 1 then. vrs must be installed with
`VRS_COMPILED=1`: else there is nothing to compare.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from random import Random

from msgspec import structs

from tests.by_hand import command
from tests.laws.lines import random_problem
from vrs_cli.engine.problem import NoRoomToStop, Problem
from vrs_cli.engine.single_motion import plan_motion
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.commands import MotionKind

# the last digit of a seed chooses its robot; only the first two have compiled formulas
ROBOTS = (*("puma560",) * 5, *("irb120",) * 3, "ur5e", "cobra600")

COMPILED = "from tests.laws.compiled_lines import print_hashes; import sys; print_hashes(*map(int, sys.argv[1:]))"
# imports the source of a module if there is an extension module beside it; packages of others have only one of the two
PREFER_SOURCES = f"""
import sys
from importlib.machinery import *
loaders = (SourceFileLoader, SOURCE_SUFFIXES), (ExtensionFileLoader, EXTENSION_SUFFIXES)
sys.path_hooks[:] = [FileFinder.path_hook(*loaders)]
sys.path_importer_cache.clear()
{COMPILED}
"""


def print_hashes(lines: int, first: int) -> None:
    """Print a hash of the plans of each seed, then the number of compiled modules that have planned them."""
    for seed in range(first, first + lines):
        print(plans_hash(seed))
    ours = [module for name, module in sys.modules.items() if name.startswith("vrs_cli.")]
    print(sum(str(module.__file__).endswith(tuple(EXTENSION_SUFFIXES)) for module in ours))


def plans_hash(seed: int) -> str:
    """Return a hash of all bits of the plans for a straight line and for a joint motion."""
    line = random_problem(arm_of(ROBOTS[seed % len(ROBOTS)]), seed)
    random, model = Random(seed), line.arm.model
    goal = tuple(map(random.uniform, model.lower, model.upper))
    turn = structs.replace(line.motion, kind=MotionKind.JOINT, pose=None, goal=goal)
    plans = result_text(line) + result_text(structs.replace(line, motion=turn))
    return hashlib.sha256(plans.encode()).hexdigest()


arm_of = cache(lambda name: arm_for(load_robot(name)))


def result_text(problem: Problem) -> str:
    """Return all numbers of the plan, or of the error."""
    try:
        return repr(plan_motion(problem))
    except (MotionError, NoRoomToStop) as error:
        return f"{error!r} {vars(error)}"


def main(lines: int, first: int = 0) -> int:
    running = [
        subprocess.Popen([sys.executable, "-c", code, str(lines), str(first)], stdout=subprocess.PIPE, text=True)
        for code in (COMPILED, PREFER_SOURCES)
    ]
    (*ours, compiled), (*theirs, interpreted) = (process.communicate()[0].split() for process in running)
    if compiled == "0":
        print("vrs is installed without VRS_COMPILED=1: there is nothing to compare")
        return 0
    assert interpreted == "0", "the sources were not preferred"
    faults = [seed for seed, pair in enumerate(zip(ours, theirs, strict=True), first) if len(set(pair)) > 1]
    for seed in faults:
        print(f"--- {ROBOTS[seed % len(ROBOTS)]}, seed {seed}: other plans than by the sources")
    print(f"{compiled} extension modules: {lines} lines and joint motions, {len(faults)} differ")
    return 1 if faults else 0


if __name__ == "__main__":
    command(main)
