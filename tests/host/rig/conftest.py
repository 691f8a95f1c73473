from collections.abc import Iterator

import pytest

from turnlight.simulation.board import SimulatedBoard


@pytest.fixture
def board() -> Iterator[SimulatedBoard]:
    with SimulatedBoard() as board:
        yield board
