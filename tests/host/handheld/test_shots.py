"""24 simulated phone shots, nine of them made bad on purpose; tests/bench/test_handheld.py takes 500."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest
from phone_shots import Sample, Shot, take

from turnlight import app
from turnlight.handheld import develop
from turnlight.handheld.handheld import Handheld
from turnlight.handheld.refining import developed
from turnlight.handheld.verdict import Problem, Verdict

pytestmark = pytest.mark.timeout(900)
"""Taking the photos takes a busy computer long, and falls to the first test."""
WIDTH_PX = 2016
"""Half of a phone's, for speed; `test_a_full_size_photo` is not reduced."""
SETS = (
    (5, 5, (Problem.FRAME, Problem.SHADOW, Problem.BLURRED)),
    (13, 5, (Problem.OBLIQUE, Problem.CLIPPED, Problem.DUPLICATE)),
    (6, 5, (Problem.SMALL, Problem.SIZE, Problem.SHADOW)),
)
GAMMA = 2.2


@dataclass(frozen=True)
class Judged:
    sample: Sample
    session: Handheld
    verdicts: tuple[Verdict, ...]

    def pairs(self) -> Iterator[tuple[Shot, Verdict]]:
        yield from zip(self.sample.shots, self.verdicts, strict=True)


@pytest.fixture(scope="module")
def judged(tmp_path_factory: pytest.TempPathFactory) -> list[Judged]:
    result = []
    for seed, good, bad in SETS:
        folder = tmp_path_factory.mktemp("shots")
        sample = take(folder, seed, good, bad, width_px=WIDTH_PX)
        session = app.new_handheld("sample", 0.85, folder / "session")
        verdicts = session.add(shot.path for shot in sample.shots)
        result.append(Judged(sample, session, verdicts))
    return result


def test_the_checks_refuse_the_bad_shots_and_no_other(judged: list[Judged]) -> None:
    for one in judged:
        for shot, verdict in one.pairs():
            problems = [fault.problem.value for fault in verdict.faults]
            assert verdict.used == (shot.bad is None), (shot.bad, problems)
            if shot.bad in (Problem.SMALL, Problem.BLURRED) and problems == [Problem.FRAME.value]:
                continue  # too bad for that: the frame's sentence says what to do as well
            if shot.bad is not None:
                assert shot.bad.value in problems
            assert verdict.sentence.endswith(".")


def test_corners_are_exact(judged: list[Judged]) -> None:
    errors = []
    for one in judged:
        for shot, verdict in one.pairs():
            if verdict.used:
                frame = one.session.manifest.photos[verdict.number - 1].frame
                assert frame is not None
                seen = frame.sighting
                off = seen.corners_px - shot.true.corners_px[seen.places]
                errors.append(float(np.median(np.linalg.norm(off, axis=-1))))
    assert len(errors) == 15
    assert max(errors) < 0.3
    assert np.median(errors) < 0.15


def test_pictures_are_what_a_perfect_camera_straight_above_sees(judged: list[Judged]) -> None:
    for one in judged:
        for shot, verdict in one.pairs():
            if verdict.used:
                picture = developed(one.session._folder, verdict.number, 512)
                assert psnr(picture.image, shot.true.ideal) > 32


def test_light_and_white_are_known(judged: list[Judged]) -> None:
    for one in judged:
        assert one.session.manifest.with_light
        for shot, verdict in one.pairs():
            if not verdict.used:
                continue
            picture = developed(one.session._folder, verdict.number, 64)
            assert picture.lighting is not None
            [light] = picture.lighting.lights
            assert angle_deg(light.position, shot.true.light) < 6
            assert angle_deg(picture.lighting.view, shot.true.view) < 1
            true = cv2.resize(shot.true.white, (64, 64), interpolation=cv2.INTER_AREA)
            assert np.mean(light.white[..., 1] / true) == pytest.approx(1.04, abs=0.09)


def test_a_session_goes_on_where_it_was_left(judged: list[Judged], tmp_path: Path) -> None:
    first = judged[0]
    maps = first.session.maps
    again = Handheld.open(first.session.folder)
    assert again.verdicts == first.session.verdicts
    [shadow] = [v for s, v in first.pairs() if s.bad is Problem.SHADOW]
    [forced] = again.force(shadow.number)
    assert forced.used and forced.faults
    assert again.maps is not None and maps is not None
    assert not np.array_equal(again.maps.diffuse, maps.diffuse)
    again.leave_out(shadow.number)
    assert again.maps.diffuse == pytest.approx(maps.diffuse, abs=0.01)


def test_the_order_of_photos_does_not_matter(judged: list[Judged], tmp_path: Path) -> None:
    good = [shot.path for shot in judged[1].sample.good[:3]]
    one, other = (app.new_handheld("s", 0.85, tmp_path / name) for name in ("one", "other"))
    one.add(good)
    for path in reversed(good):
        other.add([path])
    assert one.maps is not None and other.maps is not None
    apart = abs(one.maps.diffuse - other.maps.diffuse)
    assert apart.mean() < 0.004
    assert other.add(good[:1])[0].number == 3, "a photo that is there already is not kept again"


def test_a_photo_with_a_filter_is_used_and_the_sentence_says_so(
    judged: list[Judged], tmp_path: Path
) -> None:
    for one in judged:
        assert all(p.warning is None for p in one.session.manifest.used)
    taken = cv2.imread(str(judged[0].sample.good[0].path))
    filtered = np.rint(255 * (taken / 255.0) ** 1.8).astype(np.uint8)
    cv2.imwrite(str(tmp_path / "filtered.png"), filtered)
    session = app.new_handheld("s", 0.85, tmp_path / "session")
    [verdict] = session.add([tmp_path / "filtered.png"])
    assert verdict.used
    assert "greys are too dark: switch HDR and filters off" in verdict.sentence


def test_a_full_size_photo(tmp_path: Path) -> None:
    sample = take(tmp_path, 9, 1)
    session = app.new_handheld("sample", 0.85, tmp_path / "session")
    [verdict] = session.add([sample.shots[0].path])
    assert verdict.used
    [photo] = session.manifest.photos
    assert photo.width_px * photo.height_px > 12e6 and photo.frame is not None
    seen = photo.frame.sighting
    off = seen.corners_px - sample.shots[0].true.corners_px[seen.places]
    assert np.median(np.linalg.norm(off, axis=-1)) < 0.3
    assert psnr(session_picture(session), sample.shots[0].true.ideal) > 32


def session_picture(session: Handheld) -> np.ndarray:
    [photo] = session.manifest.photos
    pixels = session._folder.read(photo)
    seen = develop.look(pixels, photo)
    return develop.picture(photo, seen, develop.shading(photo, seen), 0.85).image


def psnr(image: np.ndarray, ideal: np.ndarray) -> float:
    """dB at the network's resolution, as it sees them: clipped, gamma 2.2."""
    ours, theirs = (
        cv2.resize(np.clip(i, 0, 1), (256, 256), interpolation=cv2.INTER_AREA) ** (1 / GAMMA)
        for i in (image, ideal)
    )
    return float(-10 * np.log10(np.mean((ours - theirs) ** 2)))


def angle_deg(a: np.ndarray, b: np.ndarray) -> float:
    cosine = float(a @ b / np.linalg.norm(a) / np.linalg.norm(b))
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
