"""Which shot tells most."""

import numpy as np
import pytest

from svbrdf import maps as svbrdf_maps
from turnlight.capture import adaptive
from turnlight.capture.plan import plan
from turnlight.estimate import next_shot
from turnlight.estimate.learning import learn
from turnlight.estimate.next_shot import Candidate, gains

from .conftest import CONFIG, pictures_of


@pytest.fixture(scope="module")
def learned(pictures):
    return learn(pictures[:4], None)


def lit(angle_deg, leds):
    return adaptive.light_at_centre(CONFIG, angle_deg, leds, 2.0)


def test_a_new_light_tells_more_than_one_already_seen(learned):
    seen = plan(CONFIG, 4, 2.0)[1]
    again = Candidate(lit(seen.angle_deg, seen.leds), 1.0)
    opposite = Candidate(lit(seen.angle_deg + 90, seen.leds), 1.0)
    repeated, new = gains(learned, [again, opposite])
    assert new > repeated > 0


def test_a_shot_twice_as_long_must_tell_twice_as_much(learned):
    same = lit(30.0, (3,))
    assert next_shot.best(learned, [Candidate(same, 2.0), Candidate(same, 1.0)]) == 1


def test_the_next_shot_is_a_new_one(learned):
    taken = plan(CONFIG, 4, 2.0)
    shot = adaptive.next_best(CONFIG, learned, taken, 2.0)
    assert (shot.angle_deg, shot.leds) not in {(t.angle_deg, t.leds) for t in taken}
    assert shot.index == 4


def test_arcs_are_neighbours_around_their_own_ring():
    arcs = [leds for leds in adaptive.led_choices(CONFIG, arcs=True) if len(leds) > 1]
    assert len(arcs) == CONFIG.led_count
    assert (0, 1, 2, 22, 23) in arcs
    assert (24, 25, 26, 27, 28) in arcs


def test_every_highlight_of_a_rough_flat_sample_is_reachable():
    rough = learn(pictures_of(svbrdf_maps.flat(16, 16, roughness=0.6), 6), None)
    assert adaptive.reachable_share(CONFIG, rough, 2.0) == pytest.approx(1.0, abs=0.02)
    assert not next_shot.shiny(rough)
    assert np.isfinite(rough.theta).all()
