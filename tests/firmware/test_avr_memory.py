"""The AVR binaries' flash, static RAM and stack, and that the build refuses what is too large."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from avr_trace import BOARDS, BUILD, traced_board

_FOOTPRINT = BUILD.parent / "avr" / "footprint.py"
_FLASH, _RAM, _STACK = 16384, 1024, 1024


def _footprint(board: str, *limits: int) -> subprocess.CompletedProcess[str]:
    elf = BUILD / f"turnlight-{board}.elf"
    command = [sys.executable, _FOOTPRINT, elf, *map(str, limits)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("board", BOARDS)
def test_it_fits(board: str) -> None:
    result = _footprint(board, _FLASH, _RAM, _STACK)
    assert result.returncode == 0
    assert re.search(r"flash \d+ of 16384 B, static RAM \d+ of 1024 B", result.stdout)


def test_the_makefile_asks_for_these_limits() -> None:
    rules = (_FOOTPRINT.parent / "avr.mk").read_text()
    for name, limit in (("FLASH", _FLASH), ("RAM", _RAM), ("STACK", _STACK)):
        assert f"\n{name}_LIMIT := {limit}\n" in rules


@pytest.mark.parametrize("over", range(3))
def test_what_is_too_large_is_refused(over: int) -> None:
    limits = [_FLASH, _RAM, _STACK]
    limits[over] = 100
    result = _footprint("atmega328p", *limits)
    assert result.returncode == 1
    assert f"{('flash', 'static RAM', 'worst stack')[over]} over the limit" in result.stderr


@pytest.mark.parametrize("board", BOARDS)
def test_the_stack_stays_below_its_bound(board: str, tmp_path: Path) -> None:
    """The bound comes from the disassembly; here is how deep the stack is seen to go."""
    found = re.search(r"worst stack (\d+)", _footprint(board, _FLASH, _RAM, _STACK).stdout)
    assert found is not None
    with traced_board(board, tmp_path) as traced:
        traced.home(20_000)
        traced.terminal.ask("get acceleration")
        traced.terminal.ask("move 18000")
        for _ in traced.load(60):
            pass
        traced.board.press_button(True)
        traced.terminal.ask("stat all")
        traced.board.press_estop(True)
        traced.board.advance(700)
        traced.board.state()
        deepest = max(h.value for h in traced.trace("stack"))
    assert 200 < deepest <= int(found[1])
