"""The engine as a technician drives it: pause, resume, stop, stop-now, retake, drop, and who listens."""

import threading
import time
from pathlib import Path

import numpy as np
import pytest

from svbrdf.maps import Maps
from turnlight.capture.durable import write
from turnlight.capture.events import (
    Enough,
    ExposureFound,
    Finished,
    Interrupted,
    Rebuilt,
    Refused,
    ShotDone,
    ShotStep,
    Snapshot,
    TableChecked,
)
from turnlight.capture.exposure import MOST_CLIPPED, sample_mask
from turnlight.capture.pipeline import MOST_WAITING
from turnlight.capture.state import State, Step
from turnlight.errors import RunError
from turnlight.estimate.estimator import Estimator
from turnlight.picture.picture import Picture
from turnlight.preset import Preset


def shots(count: int, **changes: object) -> Preset:
    return Preset(shots=count, exposure="fixed", enough_change=0).model_copy(update=changes)


def numbers(events: list[object]) -> list[int]:
    return [e.number for e in events if isinstance(e, ShotDone)]


def steps(events: list[object]) -> list[tuple[int, Step]]:
    return [(e.number, e.step) for e in events if isinstance(e, ShotStep)]


def test_every_shot_goes_through_its_steps(bench) -> None:
    bench.start(shots(3))
    order = steps(bench.until(Finished))
    for number in (1, 2, 3):
        assert [step for shot, step in order if shot == number] == list(Step)
    assert order.index((1, Step.SAVED)) < order.index((2, Step.LIT))
    bench.assert_maps_are_those_of_the_frames()


def test_the_table_moves_while_a_shot_is_saved(bench, monkeypatch: pytest.MonkeyPatch) -> None:
    positioned = threading.Event()

    def write_later(path: Path, content: bytes) -> None:
        if path.name == "000.png":
            assert positioned.wait(60)
        write(path, content)

    monkeypatch.setattr("turnlight.capture.durable.write", write_later)
    bench.start(shots(2))
    while (2, Step.POSITIONED) not in steps(seen := bench.until(ShotStep)):
        pass
    assert steps(seen) == [(2, Step.POSITIONED)]
    positioned.set()
    order = steps(bench.until(Finished))
    assert order.index((1, Step.SAVED)) < order.index((2, Step.LIT))


def test_shots_are_taken_and_the_table_is_checked_while_pictures_are_encoded(bench) -> None:
    checked = threading.Event()

    class Slow(Estimator):
        def add(self, picture: Picture) -> Maps:
            assert checked.wait(60)
            return super().add(picture)

    bench.new_estimator = Slow
    bench.start(shots(MOST_WAITING))
    before = steps(bench.until(TableChecked))
    assert [shot for shot, step in before if step is Step.VERIFIED] == list(
        range(1, MOST_WAITING + 1)
    )
    assert not [shot for shot, step in before if step is Step.ENCODED]
    checked.set()
    bench.until(Finished)
    assert len(bench.session.manifest.used) == MOST_WAITING
    bench.assert_maps_are_those_of_the_frames()


def test_pause_finishes_the_shot_and_resume_goes_on(bench) -> None:
    bench.start(shots(3))
    bench.until(State.RUNNING)
    bench.engine.pause()
    assert bench.engine.current.state is State.PAUSING
    seen = bench.until(State.PAUSED)
    taken = sum(isinstance(e, ShotStep) and e.step is Step.SAVED for e in seen)
    assert taken == len(bench.session.manifest.used)
    assert not any(bench.board.state().leds)
    assert bench.engine.verbs == ("resume", "stop", "stop now", "retake", "drop")
    with pytest.raises(RunError, match="The run is paused, and `pause` can be asked for only when"):
        bench.engine.pause()
    with pytest.raises(RunError, match="`start` can be asked for only when it is idle"):
        bench.start()
    bench.engine.resume()
    bench.until(Finished)
    assert len(bench.session.manifest.used) == 3


def test_stop_keeps_the_data(bench) -> None:
    bench.start(shots(10))
    bench.until(ShotDone)
    bench.engine.stop()
    finished = bench.until(Finished)[-1]
    manifest = bench.session.manifest
    assert 1 <= len(manifest.used) < 10
    assert finished.count == len(manifest.used)
    assert manifest.finished is not None
    assert finished.contact_sheet.exists()
    bench.until(State.IDLE)
    bench.assert_maps_are_those_of_the_frames()


def test_stop_now_goes_through_the_firmware_and_only_the_operator_undoes_it(bench) -> None:
    capture = bench.camera.capture
    stopped: list[str] = []

    def stop_while_lit(exposure):
        if bench.camera.taken == 2 and not stopped:
            bench.engine.stop_now()
            assert not any(bench.board.state().leds)
            stopped.append(bench.engine.current.state)
        return capture(exposure)

    bench.camera.capture = stop_while_lit
    bench.start(shots(3))
    before = bench.until(Interrupted)
    assert stopped == [State.RUNNING]
    assert before[-1].safe == 1
    assert "The operator stopped the rig" in str(before[-1])
    where_deg = bench.board.state().angle_deg
    bench.board.advance(500)
    assert bench.board.state().angle_deg == where_deg
    bench.engine.resume()
    bench.until(Finished)
    assert len(bench.session.manifest.used) == 3


def test_a_retake_replaces_the_frame_and_the_maps_forget_the_old_one(bench) -> None:
    bench.start(shots(3))
    bench.until(State.RUNNING)
    bench.engine.pause()
    bench.until(State.PAUSED)
    bench.engine.resume()
    while numbers(bench.until(ShotDone)) != [2]:
        pass
    before = bench.session.manifest.used[0].frame.sha256
    bench.engine.retake(1)
    events = bench.until(Finished)
    after = bench.session.manifest.used[0].frame
    assert after.sha256 != before
    assert after.image == "shots/000-2.png"
    assert {p.name for p in (bench.folder / "shots").glob("000*")} == {"000-2.png", "000.json"}
    assert any(isinstance(e, Rebuilt) for e in events)
    bench.assert_maps_are_those_of_the_frames()
    with pytest.raises(RunError, match="There is no shot 4; the session has 1 to 3"):
        bench.engine.retake(4)


def test_a_dropped_shot_is_in_the_maps_no_more_and_is_not_taken_again(bench) -> None:
    capture = bench.camera.capture

    def pause_at_the_second(exposure):
        if bench.camera.taken == 2:
            bench.engine.pause()
        return capture(exposure)

    bench.camera.capture = pause_at_the_second
    bench.start(shots(3))
    bench.until(State.PAUSED)
    bench.engine.drop(1)
    assert 1 not in bench.until(Rebuilt)[-1].shots
    bench.engine.resume()
    bench.until(Finished)
    manifest = bench.session.manifest
    assert [r.shot.index for r in manifest.used] == [1, 2]
    assert [r.dropped for r in manifest.shots if r.shot.index == 0] == ["Left out by the operator."]
    bench.assert_maps_are_those_of_the_frames()


def test_who_comes_late_gets_the_current_state_first(bench) -> None:
    assert bench.told.get() == Snapshot(State.IDLE)
    bench.start(shots(2))
    bench.until(Finished)
    bench.until(State.IDLE)
    late = bench.engine.subscribe()
    now = late.get()
    assert isinstance(now, Snapshot)
    assert (now.state, now.count, now.shots) == (State.IDLE, 2, (1, 2))
    assert (now.folder, now.sample, len(now.changes)) == (bench.folder, "oak", 1)
    assert late.get(timeout_s=0.01) is None
    late.close()
    assert list(late) == []


def test_a_rig_that_is_not_there_is_refused_and_nothing_is_written(bench) -> None:
    bench.port = "/dev/ttyNOTHERE"
    bench.start()
    refused = bench.until(Refused)[-1]
    assert "is not there; plug the controller in" in refused.cause
    assert bench.engine.wait(5)
    assert bench.engine.current.state is State.IDLE
    assert not bench.folder.exists()


def test_a_defect_faults_the_engine_and_the_shots_are_safe(bench) -> None:
    capture = bench.camera.capture

    def defect(exposure):
        if bench.camera.taken == 2:
            raise TypeError("oops")
        return capture(exposure)

    bench.camera.capture = defect
    bench.start(shots(3))
    bench.until(State.FAULTED)
    assert not any(bench.board.state().leds)
    bench.engine.wait()
    deadline_s = time.monotonic() + 30
    while bench.engine.current.cause is None:
        assert time.monotonic() < deadline_s
        time.sleep(0.01)
    assert "TypeError: oops" in bench.engine.current.cause
    assert bench.engine.verbs == ("dismiss",)
    bench.engine.dismiss()
    assert bench.engine.current.state is State.IDLE
    assert len(bench.session.manifest.used) == 1


def test_enough_is_said_and_ends_the_run_if_the_preset_says_so(bench) -> None:
    bench.start(shots(10, enough_change=0.9, stop_when_enough=True))
    events = bench.until(Finished)
    (enough,) = [e for e in events if isinstance(e, Enough)]
    assert enough.done == 3
    used = bench.session.manifest.used
    assert 3 <= len(used) <= 6
    assert [r.change is None for r in used] == [True] + [False] * (len(used) - 1)
    assert bench.engine.current.changes == tuple(r.change for r in used[1:])


def test_the_exposure_test_fixes_an_exposure_for_each_led(bench) -> None:
    bench.start(shots(3, exposure="test", bracketing=True))
    events = bench.until(Finished)
    found = [e for e in events if isinstance(e, ExposureFound)]
    manifest = bench.session.manifest
    assert [e.leds for e in found] == [shot.leds for shot in manifest.plan]
    assert [e.exposure_us for e in found] == [shot.exposure_us for shot in manifest.plan]
    assert found[0].exposure_us < 10_000 < found[1].exposure_us  # the mirror's glare, a grazing LED
    for event, saved in zip(found, bench.session.saved(), strict=True):
        assert event.clipped <= MOST_CLIPPED
        top = (1 << saved.frame.bit_depth) - 1
        mask = sample_mask(bench.config, saved.record.shot.angle_deg, 2.0)
        assert np.mean((saved.frame.pixels[mask] == top).any(axis=-1)) <= 2 * MOST_CLIPPED
        assert saved.short.exposure.exposure_us < saved.frame.exposure.exposure_us / 7
        assert bench.session.dark_record(saved.frame.exposure) is not None
        assert bench.session.dark_record(saved.short.exposure) is not None
    bench.assert_maps_are_those_of_the_frames()
