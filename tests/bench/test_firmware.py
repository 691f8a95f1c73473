"""The AVR binary's timing in figures, beside those of a stepper in a plain loop."""

import statistics
import subprocess
import time
from itertools import pairwise
from pathlib import Path

import pytest
from avr_trace import (
    BOARDS,
    BUILD,
    BYTE_CYCLES,
    CYCLES_PER_MS,
    TracedBoard,
    exchanges,
    plateau,
    traced_board,
)
from terminal import Terminal, seal

from turnlight.simulation.board import SimulatedBoard

pytestmark = pytest.mark.bench


@pytest.mark.parametrize("kind", BOARDS)
def test_the_firmwares_timing(kind: str, tmp_path: Path) -> None:
    with traced_board(kind, tmp_path) as traced:
        traced.home(10_000)
        traced.terminal.ask("move 18000")
        for _ in traced.load(220):
            pass
        intervals = plateau(traced.trace("step"), 1600)
        jitter = max(abs(interval - 1600) for interval in intervals)
        traced.terminal.settle()
        answers = traced.stat_cycles(100)
    (tmp_path / "fast").mkdir()
    with traced_board(kind, tmp_path / "fast") as traced:
        traced.home(20_000)
        traced.terminal.ask("move 18000")
        for _ in traced.load(150):
            pass
        fast = plateau(traced.trace("step"), 800)
    print(
        f"\n   {kind}: steps at 10 kHz under load within {jitter} cycles; `stat` answered in "
        f"{statistics.median(answers) / CYCLES_PER_MS:.2f} ms; "
        f"{16e6 / statistics.mean(fast):.0f} steps/s reached under load"
    )


@pytest.mark.parametrize("kind", BOARDS)
def test_stat_at_true_speed(kind: str, tmp_path: Path) -> None:
    with traced_board(kind, tmp_path, paced=True) as traced:
        traced.terminal.ask("hello")
        times_ms = [_timed_ms(traced, seal(f"{n} stat")) for n in range(30_000, 30_200)]
    print(f"\n   {kind}: `stat` through the pty at 1x in {statistics.median(times_ms):.2f} ms")
    assert statistics.median(times_ms) <= 2.5


def _timed_ms(traced: TracedBoard, line: str) -> float:
    began = time.perf_counter()
    traced.terminal.say(line)
    return (time.perf_counter() - began) * 1e3


@pytest.mark.parametrize("rate", [10_000, 20_000])
def test_a_busy_loops_timing(rate: int, tmp_path: Path) -> None:
    elf, trace = tmp_path / "busy.elf", tmp_path / "trace"
    avr = BUILD.parent / "avr"
    subprocess.run(
        [
            "avr-gcc", "-mmcu=atmega2560", "-DF_CPU=16000000UL", f"-DINTERVAL_HALF_US={2_000_000 // rate}",
            "-std=gnu11", "-Os", f"-I{avr}", Path(__file__).with_name("busy_loop.c"), "-o", elf,
        ],
        check=True,
    )  # fmt: skip
    program = BUILD / "turnlight-simavr-atmega2560"
    with SimulatedBoard(program, elf, trace) as board, Terminal(board) as terminal:
        traced = TracedBoard(board, terminal, trace)
        first = 0
        for _ in range(20):
            terminal.say("12345 led 200 FFFFFFFFF *1AFFFF")
            terminal.say("12345 stat *0AFFFF")
        rises = [step.cycle for step in traced.trace("step") if step.value == 1]
        interval = 16_000_000 // rate
        worst = max(abs(later - earlier - interval) for earlier, later in pairwise(rises))
        answers = exchanges(traced.trace("received", "sent"), first)[1::2]
    print(
        f"\n   busy loop: steps at {rate // 1000} kHz under load within {worst} cycles; `stat` "
        f"answered in {statistics.median(answers) / CYCLES_PER_MS:.2f} ms"
    )
    assert statistics.median(answers) > 54 * BYTE_CYCLES
