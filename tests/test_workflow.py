"""The workflow runs the test command of the README on the three systems."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
WORKFLOW = ROOT / ".github" / "workflows" / "tests.yml"


@pytest.mark.skipif(not WORKFLOW.exists(), reason="this is no checkout")
def test_the_workflow_runs_what_the_readme_says() -> None:
    workflow, readme = WORKFLOW.read_text(encoding="utf-8"), (ROOT / "README.md").read_text(encoding="utf-8")
    for command in ("pip install -q -e '.[dev]'", "python -m pytest -q -n 3"):
        assert command in readme
        assert command in workflow
    for system in ("ubuntu-latest", "macos-latest", "windows-latest"):
        assert system in workflow


@pytest.mark.skipif(not WORKFLOW.exists(), reason="this is no checkout")
def test_all_tests_run_on_the_oldest_supported_python() -> None:
    """asyncio differs between versions: live tests have to run on the oldest."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    oldest = project["requires-python"].removeprefix(">=")
    workflow = WORKFLOW.read_text(encoding="utf-8")
    assert f'python: ["{oldest}", ' in workflow
    command = "python -m pytest -q -n 3"
    assert f"{command}\n          {command} -m long\n" in workflow, "what one command leaves out, the next one runs"
    assert "-m " not in workflow.replace("python -m ", "").replace(" -m long", ""), "no step leaves tests out"


@pytest.mark.skipif(not WORKFLOW.exists(), reason="this is no checkout")
def test_the_wheel_is_installed_on_every_python_from_the_oldest_to_the_newest() -> None:
    wheel = WORKFLOW.read_text(encoding="utf-8").partition("\n  wheel:\n")[2]
    found = re.search(r"python: \[(.*)\]", wheel)
    assert found
    *minors, newest = json.loads(f"[{found[1]}]")
    assert newest == "3.x"
    assert minors == [f"3.{11 + place}" for place in range(len(minors))], "none between is left out"
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["requires-python"] == ">=3.11"
    assert {one.rpartition(" ")[2] for one in project["classifiers"] if "Python :: 3." in one} <= set(minors)
    ci = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    assert all(f"python{version}" in ci for version in minors)
