import json
import math
import subprocess
import sys

import pytest

from svbrdf.equal_shots import needed, ratio
from svbrdf.scores import Scores


def curve(ssims):
    return {count: Scores(ssim, ssim, 0.0, 0.0, 0.0, 0.0) for count, ssim in ssims.items()}


def test_between_counts_shots_are_interpolated_in_their_log():
    assert needed(0.6, {1: 0.4, 4: 0.8}) == pytest.approx(2)
    assert needed(0.8, {1: 0.4, 4: 0.8}) == pytest.approx(4)


def test_what_is_reached_from_the_start_takes_the_first_count_and_the_unreached_never_comes():
    assert needed(0.3, {2: 0.4, 4: 0.8}) == 2
    assert math.isinf(needed(0.9, {2: 0.4, 4: 0.8}))


def test_a_curve_that_falls_back_has_been_there():
    assert needed(0.7, {1: 0.5, 2: 0.7, 4: 0.6}) == 2


def test_the_ratio_is_the_median_over_counts():
    rows = {
        "refinement": curve({3: 0.9, 5: 0.93, 10: 0.99}),
        "classical": curve({3: 0.8, 6: 0.9, 20: 0.93}),
    }
    assert ratio(rows) == pytest.approx(4)  # 6/3, 20/5, never


def test_the_command_prints_a_line_per_material_and_their_median(tmp_path):
    log = tmp_path / "rig.jsonl"
    others = ("ssim_fitted", "normal_deg", "diffuse_rmse", "roughness_rmse", "specular_rmse")
    scores = dict.fromkeys(others, 0.0)
    rows = [("stone", "refinement", 5, 0.9), ("stone", "classical", 10, 0.9),
            ("glass", "refinement", 5, 0.9), ("glass", "classical", 10, 0.5)]  # fmt: skip
    log.write_text(
        "".join(
            json.dumps(
                {"material": material, "seed": 0, "resolution": 128, "method": method,
                 "shots": shots, "scores": {"ssim": ssim, **scores}}
            ) + "\n"
            for material, method, shots, ssim in rows
        )
    )  # fmt: skip
    command = [sys.executable, "-m", "svbrdf.equal_shots", str(log)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert [line.split()[-1] for line in done.stdout.splitlines()] == ["2.0", "never", "never"]
