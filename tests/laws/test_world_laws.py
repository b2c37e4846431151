"""The law of worlds, for a few random sessions; `python -m tests.laws.long_worlds 3000` tries many."""

import pytest

from tests.examples import first
from tests.laws.world_sessions import session


@pytest.mark.parametrize("seed", first(2, range(6)))
def test_a_course_is_that_of_a_new_world_in_a_random_session(seed: int) -> None:
    assert session(seed, 25).courses > 0
