"""The workflow runs the test command of the README on the three systems."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
WORKFLOW = ROOT / ".github" / "workflows" / "tests.yml"


@pytest.mark.skipif(not WORKFLOW.exists(), reason="this is no checkout")
def test_the_workflow_runs_what_the_readme_says() -> None:
    workflow, readme = WORKFLOW.read_text(encoding="utf-8"), (ROOT / "README.md").read_text(encoding="utf-8")
    for command in ("pip install -q -e '.[dev]'", "python -m pytest -q -n 2"):
        assert command in readme
        assert command in workflow
    for system in ("ubuntu-latest", "macos-latest", "windows-latest"):
        assert system in workflow
