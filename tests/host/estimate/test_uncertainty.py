import numpy as np
import pytest

from turnlight.estimate.uncertainty import USUAL_ERROR, Uncertainty, half_width, radius

ONE = Uncertainty(
    slopes=np.full((2, 2, 3), 1e-4, np.float32) * np.float32([1, 2, 0.5]),
    diffuse=np.full((2, 2, 3), 0.01, np.float32),
    roughness=np.full((2, 2, 1), 0.02, np.float32),
    specular=np.full((2, 2, 3), 0.003, np.float32),
)


def test_a_session_that_predicts_itself_badly_states_more():
    twice = ONE.in_proportion(2 * USUAL_ERROR)
    assert twice.diffuse == pytest.approx(2 * ONE.diffuse)
    assert twice.roughness == pytest.approx(2 * ONE.roughness)
    assert radius(twice.slopes) == pytest.approx(2 * radius(ONE.slopes))
    assert twice.specular is ONE.specular


def test_a_session_that_cannot_be_judged_states_what_the_fit_says():
    assert ONE.in_proportion(None) is ONE
    assert (ONE.in_proportion(0.0).diffuse > 0).all()


@pytest.mark.parametrize("name", ["normal", "diffuse", "roughness", "specular"])
def test_intervals_widen_with_what_is_stated_and_with_what_they_hold(name):
    stated = np.geomspace(1e-6, 1, 50, dtype=np.float32)
    half, most = (half_width(stated, name, share) for share in (50, 95))
    assert (np.diff(half) >= 0).all() and (np.diff(most) >= 0).all()
    assert (most > half).all()
