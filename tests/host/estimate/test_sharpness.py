"""A blurred shot is told by the detail that the others promise."""

import numpy as np
import pytest

from turnlight.estimate import sharpness
from turnlight.estimate.noise import noise_of
from turnlight.estimate.observations import observe

SHOTS, BLURRED = 5, 3


@pytest.fixture
def seen(pictures):
    chosen = sharpness.tiles(len(pictures[0].valid))
    some = pictures[:SHOTS]
    return observe(some, noise_of(some), chosen)


@pytest.mark.parametrize(("matte", "named"), [(True, {BLURRED}), (False, set())])
def test_a_smooth_shot_where_detail_was_promised_is_blurred_if_pixels_tell(seen, matte, named):
    logs = np.random.default_rng(0).normal(0, 0.1, seen.logs.shape).astype(np.float32)
    found = logs.copy()
    found[BLURRED] = 0.0
    usable = np.full(logs.shape[:2], matte)
    assert sharpness.blurred(seen._replace(logs=found), logs, usable) == named
