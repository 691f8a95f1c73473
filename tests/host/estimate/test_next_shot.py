"""Which shot tells most."""

from dataclasses import replace

import numpy as np
import pytest

from turnlight.capture import adaptive
from turnlight.capture.plan import plan
from turnlight.estimate import next_shot
from turnlight.estimate.brdf_kernel import ROUGHNESS, SLOPE
from turnlight.estimate.learning import learn
from turnlight.estimate.next_shot import Candidate, gains
from turnlight.estimate.noise import noise_of

from .conftest import CONFIG


@pytest.fixture(scope="module")
def learned(pictures):
    return learn(pictures[:4], noise_of(pictures[:4]), None)


def lit(angle_deg, leds):
    return adaptive.light_at_centre(CONFIG, angle_deg, leds, 2.0)


def test_a_new_light_tells_more_than_one_already_seen(learned):
    seen = plan(CONFIG, 4, 2.0)[1]
    again = Candidate(lit(seen.angle_deg, seen.leds), 1.0)
    opposite = Candidate(lit(seen.angle_deg + 90, seen.leds), 1.0)
    repeated, new = gains(learned, [again, opposite])
    assert new > repeated > 0


def test_where_shape_is_known_albedo_is_left_to_ask_for(learned):
    precision = learned.precision.copy()
    precision[:, SLOPE] = precision[:, ROUGHNESS] = 1e9
    highlight, opposite = lit(0.0, (0,)), lit(180.0, (0,))
    certain = replace(learned, precision=precision)
    assert min(gains(certain, [Candidate(highlight, 1.0), Candidate(opposite, 1.0)])) > 0.02


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


@pytest.mark.parametrize(("roughness", "shiny"), [(0.6, False), (0.1, True)])
def test_highlights_of_a_flat_sample(learned, roughness, shiny):
    theta = np.zeros_like(learned.theta)
    theta[:, ROUGHNESS] = roughness
    flat = replace(learned, theta=theta)
    assert next_shot.shiny(flat) == shiny
    share = adaptive.reachable_share(CONFIG, flat, 2.0)
    assert (share > 0.98) if not shiny else (share < 0.98)
