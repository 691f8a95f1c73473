"""The steps of a calibration, each from what is on the table to numbers and a verdict."""

from collections.abc import Callable, Generator, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from svbrdf.renderer import pixel_positions
from turnlight.calibrate.bench import Bench, four_around, green, live
from turnlight.calibrate.check import paper_reflectance
from turnlight.calibrate.colour import fit_colour, read_chart
from turnlight.calibrate.events import Criterion, Event, Place, Seen
from turnlight.calibrate.geometry import View, adjust
from turnlight.calibrate.lights import Sight, find_highlight, place_leds
from turnlight.calibrate.targets import TARGET_OF, Targets
from turnlight.calibrate.white import bare, fit_lights, read_board
from turnlight.calibration import Calibration, Dark, StepName, triple
from turnlight.config import RigConfig
from turnlight.errors import ImageError
from turnlight.frame import Exposure, Frame
from turnlight.picture.charuco import find_corners
from turnlight.picture.lighting import lighting
from turnlight.picture.platter import locate
from turnlight.picture.radiometry import linear
from turnlight.picture.rectify import rectify
from turnlight.picture.warp import Image

BOARD_ANGLES_DEG = tuple(range(0, 360, 30))
BALL_ANGLES_DEG = (0, 90, 180, 270)
WHITE_ANGLES_DEG = (0, 180)
DARK_FRAMES = 4
HIGHLIGHT_SHORTER = 10
"""The ball's highlights are many times brighter than paper."""
CHART_RESOLUTION = 512


@dataclass(frozen=True)
class Outcome:
    """What a step found. text: in a sentence."""

    calibration: Calibration
    text: str
    criteria: tuple[Criterion, ...]


Steps = Generator[Event, None, Outcome]


def dark(bench: Bench, config: RigConfig, targets: Targets) -> Steps:
    """Dark level and noise, and the room's light."""
    yield _place("dark", targets)
    usual = bench.exposure
    short = Exposure(100, usual.gain)
    frames: list[Image] = []
    for number, exposure in enumerate([short] * DARK_FRAMES + [usual], 1):
        frame = bench.frame((), exposure)
        frames.append(linear(frame, frame.pixels))
        yield Seen("dark", number, DARK_FRAMES + 1, live(frame))
    levels = np.array([frame.mean(axis=(0, 1)) for frame in frames[:-1]])
    noise = float(np.std(frames[0] - frames[1]) / np.sqrt(2))
    level = levels.mean(axis=0)
    brightest = np.percentile(frames[-1], 99, axis=(0, 1)) - level
    room = np.maximum(brightest, 0) * 10_000 / usual.exposure_us / usual.gain
    found = Dark(
        level=triple(level), level_sigma=triple(levels.std(axis=0)), noise=noise, room=triple(room)
    )
    return Outcome(
        config.geometry.model_copy(update={"dark": found}),
        f"{level.mean():.2%} of full scale without light, noise {noise:.2%}; the room adds "
        f"{room.max():.1%}",
        (
            Criterion("dark level", float(level.max()), 0.1, "of full scale"),
            Criterion("room light", float(brightest.max()), 0.1, "of full scale"),
        ),
    )


def geometry(bench: Bench, config: RigConfig, targets: Targets) -> Steps:
    """Lens, camera pose, axis, markers."""
    yield _place("geometry", targets)
    leds = four_around(config, 0)
    exposure = bench.expose(leds)
    views = []
    for number, angle_deg in enumerate(BOARD_ANGLES_DEG, 1):
        reached = bench.turn(angle_deg)
        frame = bench.frame(leds, exposure)
        yield Seen("geometry", number, len(BOARD_ANGLES_DEG), live(frame))
        try:
            views.append(View(reached, locate(frame, config), find_corners(green(frame))))
        except ImageError:  # one frame less; `adjust` says when too few are left
            continue
    fit = adjust(config, views, targets.square_mm)
    lens, camera, table = fit.calibration.lens, fit.calibration.camera, fit.calibration.table
    return Outcome(
        fit.calibration,
        f"{fit.views} frames, corners {fit.residual_px:.2f} px from their places; focal length "
        f"{lens.focal_px[0]:.1f} px, axis {np.hypot(*table.axis_mm):.2f} mm from the platter's "
        f"middle, runout {table.radial_runout_mm:.3f} mm",
        (
            Criterion("corner residual", fit.residual_px, 0.6, "px"),
            Criterion("camera rotation", _norm(camera.rotation_sigma_deg), 0.2, "°"),
            Criterion("camera position", _norm(camera.position_sigma_mm), 1.0, "mm"),
            Criterion("axis position", _norm(table.axis_sigma_mm), 0.1, "mm"),
            Criterion("radial runout", table.radial_runout_mm, 0.3, "mm"),
            Criterion("table angle", fit.angle_error_deg, 0.1, "°"),
        ),
    )


def lights(bench: Bench, config: RigConfig, targets: Targets) -> Steps:
    """Where the LEDs are."""
    yield _place("lights", targets)
    usual = bench.exposure
    exposure = Exposure(max(usual.exposure_us // HIGHLIGHT_SHORTER, 100), usual.gain)
    radius = targets.ball_diameter_mm / 2
    ball = np.array([*targets.ball_place_mm, radius]), radius
    sights = []
    for number, led, angle_deg, frame, without in _by_each_led(
        bench, config, BALL_ANGLES_DEG, exposure
    ):
        yield Seen("lights", number, len(BALL_ANGLES_DEG) * config.led_count, live(frame))
        place = find_highlight(frame, without, config, angle_deg, ball)
        if place is not None:
            sights.append(Sight(led, angle_deg, place))
    fit = place_leds(config, sights, targets.ball_place_mm, targets.ball_diameter_mm)
    off_deg = [
        np.degrees(_norm(led.position_sigma_mm) / _norm(led.position_mm))
        for led in fit.calibration.led
    ]
    return Outcome(
        fit.calibration,
        f"{len(sights)} highlights, {fit.residual_px:.2f} px from their places; LEDs known to "
        f"{max(off_deg):.2f}° or better",
        (
            Criterion("highlight residual", fit.residual_px, 1.5, "px"),
            Criterion("LED direction", float(max(off_deg)), 1.0, "°"),
        ),
    )


def white(bench: Bench, config: RigConfig, targets: Targets) -> Steps:
    """Power, lobe and colour of each LED; vignetting; the platter's paper."""
    yield _place("white", targets)
    exposure = bench.expose(range(config.led_count)[:1], brightest=0.5)
    plain = bare(config)
    boards, papers = [], []
    for number, led, _, frame, without in _by_each_led(bench, config, WHITE_ANGLES_DEG, exposure):
        yield Seen("white", number, len(WHITE_ANGLES_DEG) * config.led_count, live(frame))
        boards.append(read_board(frame, without, plain, led, targets.thickness_mm))
        if led in four_around(config, 0):
            papers.append((frame, without, led))
    fit = fit_lights(plain, boards, targets.white_reflectance)
    lit = config.calibrated(fit.calibration)
    paper = [paper_reflectance(frame, without, lit, led) for frame, without, led in papers]
    found = fit.calibration.model_copy(
        update={"paper": float(np.median(paper)), "colour": config.geometry.colour}
    )
    powers = np.array([led.power for led in found.led])
    sigma = max(led.power_sigma / led.power for led in found.led)
    return Outcome(
        found,
        f"powers {powers.min():.2f} to {powers.max():.2f}, known to {sigma:.2%} against the board; "
        f"its light is predicted to {fit.residual:.2%}",
        (
            Criterion("LED power", sigma, 0.02, "of it"),
            Criterion("flat field", fit.residual, 0.03, "of it"),
        ),
    )


def colour(bench: Bench, config: RigConfig, targets: Targets) -> Steps:
    """The matrix to sRGB."""
    yield _place("colour", targets)
    plain = config.calibrated(config.geometry.model_copy(update={"colour": None}))
    leds = four_around(config, -1)  # grazing: nothing shines in the patches
    bench.turn(0)
    exposure = bench.expose(leds[:1])
    without = bench.frame((), exposure)
    images = []
    for number, led in enumerate(leds, 1):
        frame = bench.frame((led,), exposure)
        yield Seen("colour", number, len(leds), live(frame))
        images.append(_reflectance(frame, without, plain, led, targets.thickness_mm))
    judged = fit_colour(read_chart(np.asarray(np.nanmean(images, axis=0), np.float32)))
    found = judged.colour
    return Outcome(
        config.geometry.model_copy(update={"colour": found}),
        f"ΔE00 of patches left out in turn {found.delta_e00_mean:.2f} in the mean, "
        f"{found.delta_e00_max:.2f} at most ({judged.worst})",
        (Criterion("ΔE00 in the mean", found.delta_e00_mean, 3.0, ""),),
    )


STEPS: dict[StepName, Callable[[Bench, RigConfig, Targets], Steps]] = {
    "dark": dark,
    "geometry": geometry,
    "lights": lights,
    "white": white,
    "colour": colour,
}


def _by_each_led(
    bench: Bench, config: RigConfig, angles_deg: Sequence[float], exposure: Exposure
) -> Iterator[tuple[int, int, float, Frame, Frame]]:
    """Number from 1, LED, angle, the frame lit by it, and the dark frame of that angle."""
    number = 0
    for angle_deg in angles_deg:
        reached = bench.turn(angle_deg)
        without = bench.frame((), exposure)
        for led in range(config.led_count):
            number += 1
            yield number, led, reached, bench.frame((led,), exposure), without


def _reflectance(
    frame: Frame, without: Frame, config: RigConfig, led: int, thickness_mm: float
) -> Image:
    """(n, n, 3) of a flat matte target, NaN where the sensor clipped."""
    seen = rectify(frame, without, config, thickness_mm, CHART_RESOLUTION, (led,))
    known = lighting(
        config, (led,), seen.measured_angle_deg, frame.exposure, thickness_mm, CHART_RESOLUTION
    ).lights[0]
    toward = known.position - pixel_positions(np, CHART_RESOLUTION, CHART_RESOLUTION)
    cosine = toward[..., 2:] / np.linalg.norm(toward, axis=-1, keepdims=True)
    image = np.where(seen.picture.clipped[..., None], np.nan, seen.picture.image)
    return np.asarray(image / (known.white * cosine), np.float32)


def _place(step: StepName, targets: Targets) -> Place:
    target = TARGET_OF[step]
    return Place(step, target, targets.instruction(target))


def _norm(values: Sequence[float]) -> float:
    return float(np.linalg.norm(values))
