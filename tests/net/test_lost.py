"""Lines are done as their authors are told, over cuts; `python -m tests.net.lost 100` does it for long."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.live import until
from tests.net.lost import ROBOTS, Author, Told, authors, check
from tests.net.serving import serving


@pytest.mark.long
def test_three_cuts(tmp_path: Path) -> None:
    with serving(tmp_path, ROBOTS, realtime=1.0) as it:

        def url(robot: str) -> str:
            return f"{it.address}/robots/{robot}"

        with authors(url, 1) as (writing, cables):
            every = writing.values()
            for author in every:
                author.start()
            for least in (3, 6, 9):
                until(lambda least=least: all(done(author) >= least for author in every))  # type: ignore[misc]
                for cable in cables:
                    cable.shut()
                until(lambda: not any(author.open for author in every))
                for cable in cables:
                    cable.open()
                until(lambda: all(author.open for author in every))
            for robot, author in writing.items():
                author.join()
                check(author, robot, url(robot), killed=False)


def done(author: Author) -> int:
    return list(author.told.values()).count(Told.DONE)
