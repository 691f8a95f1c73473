"""The real AVR binary under libsimavr, its pins watched to the cycle."""

import random
import statistics
from collections.abc import Iterator
from pathlib import Path

import pytest
from avr_trace import BOARDS, CYCLES_PER_MS, TracedBoard, led_bursts, plateau, traced_board

_JITTER_CYCLES = 80
_STOP_TRIALS = 5


@pytest.fixture(params=BOARDS)
def traced(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[TracedBoard]:
    with traced_board(request.param, tmp_path) as traced:
        yield traced


def test_steps_at_10_khz_keep_time_under_full_load(traced: TracedBoard) -> None:
    traced.home(10_000)
    traced.terminal.ask("move 18000")
    for answer in traced.load(220):
        assert " ok " in answer
    intervals = plateau(traced.trace("step"), 1600)
    assert len(intervals) > 4000
    worst = max(abs(interval - 1600) for interval in intervals)
    assert worst <= _JITTER_CYCLES
    assert not traced.trace("lost")


def test_20_khz_is_reached_and_no_step_is_lost(traced: TracedBoard) -> None:
    traced.home(20_000)
    before = traced.board.state()
    traced.terminal.ask("move 18000")
    for answer in traced.load(150):
        assert " ok " in answer
    assert traced.terminal.settle() == "ready"
    intervals = plateau(traced.trace("step"), 800)
    assert len(intervals) > 2000
    assert statistics.mean(intervals) == pytest.approx(800, abs=0.1)
    assert traced.board.state().steps == before.steps + 8000
    assert traced.board.state().angle_deg == 180


def test_no_output_is_wrong_for_a_cycle_around_a_reset(traced: TracedBoard) -> None:
    outputs = ("step", "strobe", "supply", "enable")
    off = {("step", 0), ("strobe", 0), ("supply", 0), ("enable", 1)}
    assert {(h.what, h.value) for h in traced.trace(*outputs)} <= off
    traced.home(8_000)
    traced.terminal.ask("led 255 FFF")
    traced.terminal.ask("move 18000")
    assert not any(traced.board.reset().leds)
    traced.terminal.ask("hello")
    *_, reset = traced.trace("reset")
    after = [h for h in traced.trace(*outputs) if h.cycle >= reset.cycle]
    assert {("supply", 0), ("enable", 1)} <= {(h.what, h.value) for h in after} <= off
    assert {h.cycle for h in after} == {reset.cycle}


def test_a_step_pulse_is_long_enough_for_any_driver(traced: TracedBoard) -> None:
    traced.home(20_000)
    edges = traced.trace("step")
    assert [edge.value for edge in edges] == [1, 0] * (len(edges) // 2)
    assert min(down.cycle - up.cycle for up, down in zip(edges[::2], edges[1::2], strict=True)) > 80


@pytest.mark.parametrize("stop", ["pin", "byte"])
def test_no_step_comes_later_than_1_ms_after_a_stop(stop: str, traced: TracedBoard) -> None:
    chance = random.Random(5)
    for _ in range(_STOP_TRIALS):
        traced.home(10_000)
        traced.terminal.ask("move 18000")
        for _ in traced.load(chance.randrange(20, 70)):
            pass
        traced.board.advance(chance.random())
        assert traced.board.state().steps < traced.board.advance(1).steps
        burst = next(led_bursts(2))
        if stop == "pin":
            traced.press_estop_behind(burst)
        else:
            at = chance.randrange(len(burst))
            traced.terminal.send(burst[:at] + b"\x18" + burst[at:])
        for _ in range(2):
            traced.terminal.hear()
        for _ in traced.load(20):
            pass
        traced.board.press_estop(False)
        assert traced.terminal.ask("clear") == "ok"
    stops = [
        event.cycle
        for event in traced.trace("estop", "received")
        if event.value == (1 if event.what == "estop" else 0x18)
    ]
    assert len(stops) == _STOP_TRIALS
    happenings = traced.trace("step", "supply", "enable")
    for cycle in stops:
        soon = [h for h in happenings if cycle <= h.cycle < cycle + 40 * CYCLES_PER_MS]
        assert all(h.cycle <= cycle + CYCLES_PER_MS for h in soon if h.what == "step")
        (dark,) = (h for h in soon if h.what == "supply")
        assert dark.value == 0
        assert dark.cycle <= cycle + 1.1 * CYCLES_PER_MS
        let_go = [h for h in soon if h.what == "enable" and h.value == 1]
        assert bool(let_go) == (stop == "pin")


@pytest.mark.parametrize(("turning", "limit_ms"), [(False, 2.5), (True, 3.0)])
def test_stat_is_answered_soon(turning: bool, limit_ms: float, traced: TracedBoard) -> None:
    """From the first bit of the request to the last of the answer, both as long as they get: at
    rest, and turning at 8 kHz."""
    traced.home(8_000)
    traced.terminal.ask("move 18000")
    traced.board.advance(200)
    if not turning:
        traced.terminal.settle()
    cycles = traced.stat_cycles(50)
    assert len(cycles) >= 50
    assert statistics.median(cycles) <= limit_ms * CYCLES_PER_MS


@pytest.mark.parametrize("kind", BOARDS)
def test_a_hung_main_loop_is_reset_within_500_ms(kind: str, tmp_path: Path) -> None:
    with traced_board(kind, tmp_path, "-hang") as traced:
        traced.home(8_000)
        boot = traced.terminal.fields("hello")["boot"]
        traced.terminal.ask("led 255 FFF")
        traced.terminal.ask("move 18000")
        start = traced.trace("received")[-1].cycle
        traced.board.press_button(True)  # and the main loop hangs
        after = traced.board.advance(300)
        traced.board.press_button(False)
        assert not any(after.leds)
        hello = traced.terminal.fields("hello")
        assert hello["reset"] == "watchdog"
        assert hello["boot"] != boot
        assert traced.terminal.state() == "unhomed"
        power_up, reset = traced.trace("reset")
        dark = traced.trace("supply")[-1]
        last_step = traced.trace("step")[-1]
        assert power_up.cycle < start < dark.cycle < reset.cycle < start + 500 * CYCLES_PER_MS
        assert last_step.cycle <= dark.cycle
        assert dark.value == 0
