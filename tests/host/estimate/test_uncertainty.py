import numpy as np
import pytest

from turnlight.estimate.uncertainty import USUAL_ERROR, half_width, proportion_of


def test_a_session_that_predicts_itself_badly_states_more():
    assert proportion_of(2 * USUAL_ERROR) == pytest.approx(2 * proportion_of(USUAL_ERROR))
    assert proportion_of(0.0) > 0


def test_a_session_that_cannot_be_judged_states_what_the_fit_says():
    assert proportion_of(None) == 1


@pytest.mark.parametrize("name", ["normal", "diffuse", "roughness", "specular"])
def test_intervals_widen_with_what_is_stated_and_with_what_they_hold(name):
    stated = np.geomspace(1e-6, 1, 50, dtype=np.float32)
    half, most = (half_width(stated, name, share) for share in (50, 95))
    assert (np.diff(half) >= 0).all() and (np.diff(most) >= 0).all()
    assert (most > half).all()
