"""How well a session explains itself: each shot left out of the fit in turn, and predicted."""

from dataclasses import dataclass

import numpy as np

from turnlight.estimate.learning import Learned
from turnlight.estimate.map_kernel import SEEN
from turnlight.estimate.observations import fit_pixels, predicted

GAMMA = 2.2
_ITERATIONS = 8
_EVERY = 3
"""Of the sample's pixels, for speed."""


@dataclass(frozen=True)
class Quality:
    """relighting_error: mean over the good shots of `by_shot`, None with fewer than two of them.

    by_shot: mean absolute difference between the shot and its prediction without it, as a display shows
    them (gamma 2.2, 1 being white that faces the light); None for a shot that cannot be judged.
    residuals: upper quartile of |ln(model / picture)| in the fit of all. bad: shots, from 0, that contradict
    the others and were left out.
    """

    relighting_error: float | None
    by_shot: tuple[float | None, ...]
    residuals: tuple[float | None, ...]
    bad: tuple[int, ...]


def leave_one_out(learned: Learned) -> Quality:
    """Refit the sample without each shot in turn, from what all shots have taught."""
    every = np.arange(0, learned.seen.pixels, _EVERY)
    seen = learned.seen.of_pixels(every)
    theta, mean, precision = learned.theta[every], learned.mean[every], learned.precision[every]
    good = [k for k in range(seen.shots) if k not in learned.bad and (seen.state[k] == SEEN).any()]
    by_shot: list[float | None] = [None] * seen.shots
    for shot in good if len(good) > 1 else []:
        left, _ = fit_pixels(seen.without(shot), theta, mean, precision, _ITERATIONS)
        usable = seen.state[shot] == SEEN
        white = sum(seen.white[m] for m in np.flatnonzero(seen.shot_of == shot))
        there, meant = (
            np.maximum(np.exp(logs[shot]) - seen.floor[shot], 0)[usable] / white[usable]
            for logs in (seen.logs, predicted(seen, left))
        )
        shown = [np.clip(values, 0, 1) ** (1 / GAMMA) for values in (there, meant)]
        by_shot[shot] = float(np.abs(shown[0] - shown[1]).mean())
    known = [error for error in by_shot if error is not None]
    residuals = tuple(float(r) if np.isfinite(r) else None for r in learned.residuals)
    return Quality(float(np.mean(known)) if known else None, tuple(by_shot), residuals, learned.bad)
