"""The sequencer keeps only frames that are proven to show what was asked for."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from svbrdf.maps import Maps, flat
from turnlight.capture import sequencer
from turnlight.capture.manifest import Manifest
from turnlight.capture.plan import Shot
from turnlight.capture.sequencer import Rig
from turnlight.capture.session import Session
from turnlight.config import RigConfig
from turnlight.errors import CameraError, LinkError, RigError, TurnlightError
from turnlight.frame import Exposure, Frame
from turnlight.picture.picture import Picture
from turnlight.picture.rectify import Rectified
from turnlight.rig.controller import Status, Strobe

REFERENCE = Path(__file__).parents[3] / "rig_config/simulated.toml"
SHOTS = tuple(Shot(i, 90.0 * i, (i,), 10_000, 1.0) for i in range(3))


@dataclass
class FakeRig:
    """Controller, camera and clock in one, keeping a diary of what happens in which order."""

    diary: list[str] = field(default_factory=list)
    time_us: int = 0
    angle_deg: float = 0.0
    leds: tuple[int, ...] = ()
    state: str = "ready"
    frame_change: dict[str, Any] = field(default_factory=dict)
    dead_line: bool = False

    def home(self) -> None:
        self.diary.append("home")

    def move(self, angle_deg: float) -> None:
        self.diary.append(f"move {angle_deg:.0f}")
        self.angle_deg = angle_deg

    def light(self, leds: Sequence[int]) -> None:
        self.diary.append(f"light {leds[0]}")
        self.leds = tuple(leds)

    def off(self) -> None:
        if self.dead_line:
            raise LinkError("The line is dead.")
        self.diary.append("off")
        self.leds = ()

    def trigger(self, shot_id: int) -> Strobe:
        self.diary.append("trigger")
        return Strobe(shot_id, self.angle_deg, self.leds, self.time_us)

    def status(self) -> Status:
        self.diary.append("status")
        return Status(self.time_us, self.angle_deg, self.leds, self.state, True, 0, 0)

    def now_s(self) -> float:
        return self.time_us / 1e6

    def sleep(self, seconds: float) -> None:
        self.diary.append("settle")
        self.time_us += round(seconds * 1e6)

    def capture(self, exposure: Exposure) -> Frame:
        self.diary.append("capture")
        pixels = np.zeros((4, 4, 3), np.uint16)
        frame = Frame(pixels, 12, 2.2, exposure, self.time_us)
        self.time_us += exposure.exposure_us
        return replace(frame, **self.frame_change) if self.leds else frame

    def close(self) -> None:
        pass


class FakeEstimator:
    def __init__(self, rig: FakeRig) -> None:
        self.rig = rig
        self.count = 0

    def add(self, _: Picture) -> Maps:
        self.rig.diary.append("estimate")
        self.count += 1
        return flat(8, 8, roughness=self.count / 10)


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> FakeRig:
    fake = FakeRig()

    def rectify(*arguments: object) -> Rectified:
        fake.diary.append("rectify")
        everywhere = np.ones((8, 8), bool)
        picture = Picture(np.zeros((8, 8, 3), np.float32), 1.0, everywhere, ~everywhere)
        return Rectified(picture, fake.angle_deg - 0.2, 8, 0.05)

    monkeypatch.setattr(sequencer, "rectify", rectify)
    return fake


@pytest.fixture
def session(tmp_path: Path, rig: FakeRig, monkeypatch: pytest.MonkeyPatch) -> Session:
    manifest = Manifest(
        sample="oak",
        thickness_mm=2.0,
        started=datetime(2026, 11, 22, tzinfo=UTC),
        versions={},
        model_sha256={},
        config=RigConfig.load(REFERENCE),
        plan=SHOTS,
    )
    session = Session(tmp_path / "oak", manifest)
    save = session.save_shot

    def noted(*arguments: Any) -> Any:
        rig.diary.append("save")
        return save(*arguments)

    monkeypatch.setattr(session, "save_shot", noted)
    return session


def run(rig: FakeRig, session: Session, shots: Sequence[Shot] = SHOTS) -> list[sequencer.ShotDone]:
    parts: Any = rig
    whole = Rig(session.manifest.config, parts, parts, parts)
    return list(sequencer.run(whole, session, shots, 2.0, FakeEstimator(rig)))


def test_the_order_of_things(rig: FakeRig, session: Session) -> None:
    events = run(rig, session, SHOTS[:2])
    dark = ["home", "off", "settle", "capture"]
    setup = ["settle", "trigger", "capture", "status", "off"]
    use = ["save", "rectify", "estimate"]
    assert rig.diary == [
        *dark,
        *["move 0", "light 0", *setup, *use],
        *["move 90", "light 1", *setup, *use],
        "off",
    ]
    assert [event.number for event in events] == [1, 2]
    assert events[0].change is None
    assert events[1].change == pytest.approx(0.1 * 64 / (10 * 64))
    assert session.manifest.finished is not None


def test_a_dark_frame_for_each_exposure(rig: FakeRig, session: Session) -> None:
    run(rig, session, [SHOTS[0], replace(SHOTS[1], exposure_us=20_000), SHOTS[2]])
    assert [d.exposure.exposure_us for d in session.manifest.darks] == [10_000, 20_000]


@pytest.mark.parametrize(
    ("fault", "error", "complaint"),
    [
        ({"frame_change": {"exposure": Exposure(9_000, 1.0)}}, CameraError, "exposed 9000 us"),
        ({"frame_change": {"started_us": 11_999}}, CameraError, "before the light had settled"),
        ({"state": "estop"}, RigError, "the rig reports estop"),
    ],
)
def test_a_frame_that_is_not_as_asked_is_not_kept(
    rig: FakeRig,
    session: Session,
    fault: dict[str, Any],
    error: type[TurnlightError],
    complaint: str,
) -> None:
    for name, value in fault.items():
        setattr(rig, name, value)
    with pytest.raises(error, match=complaint):
        run(rig, session)
    assert rig.diary[-1] == "off"
    assert "save" not in rig.diary
    assert session.manifest.shots == ()


def test_leds_and_angle_must_be_as_asked(
    rig: FakeRig, session: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patched, pytest.raises(RigError, match="LEDs 0 were asked for"):
        patched.setattr(rig, "light", lambda _: setattr(rig, "leds", (0, 5)))
        run(rig, session)
    monkeypatch.setattr(rig, "move", lambda _: setattr(rig, "angle_deg", 1.0))
    with pytest.raises(RigError, match=r"sent to 0\.00 degrees but is at 1\.00"):
        run(rig, session)


def test_a_dead_line_does_not_hide_the_cause(rig: FakeRig, session: Session) -> None:
    run_out = replace(rig, frame_change={"started_us": 0})

    def unplugged() -> Status:
        run_out.dead_line = True
        raise LinkError("The cable is out.")

    run_out.status = unplugged  # type: ignore[method-assign]
    with pytest.raises(LinkError, match="The cable is out"):
        run(run_out, session)
