"""The table is homed again behind the last shot, and what it has lost is told."""

from collections.abc import Callable

from turnlight.capture.events import Finished, TableChecked
from turnlight.frame import Frame
from turnlight.preset import Preset

_SHOTS = Preset(shots=2, exposure="fixed", enough_change=0)
_CAPTURES = 1 + 2  # one of them in the dark


def _check_after(bench, mishap: Callable[[], object]) -> TableChecked:
    """What is told at the end of a run when this happens behind its last exposure."""
    capture, taken = bench.camera.capture, []

    def capture_then_fail(exposure) -> Frame:
        taken.append(capture(exposure))
        if len(taken) == _CAPTURES:
            mishap()
        return taken[-1]

    bench.camera.capture = capture_then_fail
    bench.start(_SHOTS)
    (checked,) = (e for e in bench.until(Finished) if isinstance(e, TableChecked))
    return checked


def test_a_good_table_has_lost_nothing(bench) -> None:
    assert _check_after(bench, lambda: None) == TableChecked(steps_lost=0)


def test_steps_lost_in_a_run_are_told_at_its_end(bench) -> None:
    checked = _check_after(bench, lambda: bench.board.slip(-1.8))
    assert checked.steps_lost == 80
    assert str(checked).startswith("The table lost 80 steps in this run; check its load")


def test_a_blind_sensor_at_the_end_ends_nothing(bench) -> None:
    checked = _check_after(bench, lambda: bench.board.hide_mark(True))
    assert checked.steps_lost is None
    assert "check the index sensor" in str(checked)
