"""How many shots one method needs for what another makes of fewer: `python -m svbrdf.equal_shots LOG`.

LOG is that of `svbrdf.evaluate --rig --log`. Per material the median, over the counts of refinement's shots,
of classical shots for equal SSIM over those shots; "never" where the classical optimisation did not get
there with any count in the log.
"""

import argparse
import math
from collections.abc import Mapping
from pathlib import Path
from statistics import median

from svbrdf.rig_evaluation import Log, Rows

METHOD, OTHER = "refinement", "classical"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("log", type=Path, help="JSON lines of svbrdf.evaluate --rig --log")
    log = Log(parser.parse_args().log)
    ratios = {}
    for draw in log.draws():
        rows = log.rows(draw)
        if rows.get(METHOD) and rows.get(OTHER):
            ratios[f"{draw.material} {draw.seed}"] = ratio(rows)
    for name, value in ratios.items():
        print(f"{name:>24}  {_text(value)}")
    if ratios:
        print(f"{'median':>24}  {_text(median(ratios.values()))}")


def ratio(rows: Rows) -> float:
    """Of one material; infinite where more than half of the counts are never caught up with."""
    ours, theirs = ({n: s.ssim for n, s in rows[method].items()} for method in (METHOD, OTHER))
    return median(needed(ssim, theirs) / count for count, ssim in ours.items())


def needed(ssim: float, curve: Mapping[int, float]) -> float:
    """Shots with which a curve of SSIM by number of shots first reaches ssim, between its counts linear in
    their log; infinite where it never does, and its first count where it is there from the start."""
    before: tuple[int, float] | None = None
    for count, reached in sorted(curve.items()):
        if reached >= ssim:
            if before is None:
                return count
            share = (ssim - before[1]) / (reached - before[1])
            return math.exp(math.log(before[0]) + share * (math.log(count) - math.log(before[0])))
        before = (count, reached)
    return math.inf


def _text(value: float) -> str:
    return "never" if math.isinf(value) else f"{value:.1f}"


if __name__ == "__main__":
    main()
