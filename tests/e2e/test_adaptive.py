"""A capture whose shots are chosen one by one, on the simulated rig with a small sensor."""

from collections.abc import Sequence

import pytest

from turnlight.capture import adaptive
from turnlight.capture.events import Finished, Interrupted, ShotDone
from turnlight.capture.plan import FIRST_BLOCK, Shot, plan
from turnlight.config import RigConfig
from turnlight.preset import Preset

ADAPTIVE = Preset(shots=5, order="adaptive", enough_change=0)
pytestmark = pytest.mark.parametrize("port", ["simulated"], indirect=True)


@pytest.fixture(autouse=True)
def any_choice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Which shot is chosen has tests of its own, in host/estimate."""

    def chosen(
        config: RigConfig, learned: None, before: Sequence[Shot], thickness_mm: float
    ) -> Shot:
        return plan(config, 2 * len(before) + 1, thickness_mm)[len(before)]

    monkeypatch.setattr(adaptive, "learn", lambda *_: None)
    monkeypatch.setattr(adaptive, "next_best", chosen)


def asked(shots: tuple[Shot, ...]) -> list[tuple[float, tuple[int, ...]]]:
    return [(shot.angle_deg, shot.leds) for shot in shots]


def test_the_session_records_the_order_that_was_chosen(bench) -> None:
    bench.start(ADAPTIVE)
    events = bench.until(Finished)
    manifest = bench.session.manifest
    assert manifest.preset.order == "adaptive"
    assert [record.shot for record in manifest.used] == list(manifest.plan)
    assert [shot.index for shot in manifest.plan] == list(range(5))
    assert asked(manifest.plan[:FIRST_BLOCK]) == asked(bench.plan(FIRST_BLOCK))
    assert len(set(asked(manifest.plan))) == 5
    assert {event.count for event in events if isinstance(event, ShotDone)} == {5}
    bench.assert_maps_are_those_of_the_frames()


def test_what_was_chosen_stays_and_a_resumed_session_goes_on_choosing(bench) -> None:
    bench.start(ADAPTIVE)
    while bench.until(ShotDone)[-1].number <= FIRST_BLOCK:
        pass
    bench.engine.stop_now()
    bench.until(Interrupted)
    before = bench.session.manifest.plan
    assert len(before) > FIRST_BLOCK
    bench.engine.resume()
    bench.until(Finished)
    manifest = bench.session.manifest
    assert manifest.plan[: len(before)] == before
    assert len(manifest.used) == 5
