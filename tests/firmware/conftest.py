"""Simulated boards of every kind that there is: the same tests run on each."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from turnlight.simulation.board import BUILD, CHIPS, PROGRAM, SimulatedBoard

_COMMANDS: dict[str, tuple[Path, ...]] = {
    "native": (PROGRAM,),
    **{
        chip: (BUILD / f"turnlight-simavr-{chip}", BUILD / f"turnlight-{chip}.elf")
        for chip in CHIPS
    },
}


@pytest.fixture(params=list(_COMMANDS))
def backend(request: pytest.FixtureRequest) -> str:
    kind: str = request.param
    missing = [file.name for file in _COMMANDS[kind] if not file.exists()]
    assert not missing, f"{' and '.join(missing)} not built; run make firmware"
    return kind


@pytest.fixture
def power_up(backend: str) -> Iterator[Callable[[], SimulatedBoard]]:
    """Makes boards that nobody has set up yet; they end with the test."""
    with ExitStack() as boards:
        yield lambda: boards.enter_context(SimulatedBoard(*_COMMANDS[backend]))


@pytest.fixture
def board(power_up: Callable[[], SimulatedBoard]) -> SimulatedBoard:
    return power_up()
