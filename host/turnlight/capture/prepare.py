"""Before the first shot: the table homed, an exposure for each LED, and which dark frames are missing."""

from collections.abc import Callable, Iterator

from turnlight.capture.events import Event, ExposureFound
from turnlight.capture.exposure import find_exposure
from turnlight.capture.recovery import Recovery
from turnlight.capture.session import Session
from turnlight.capture.shot import shorter
from turnlight.frame import Exposure
from turnlight.rig.rig import Rig


def prepare(
    rig: Rig,
    recovery: Recovery,
    session: Session,
    publish: Callable[[Event], None],
    pause_point: Callable[[], None],
) -> None:
    """Make the rig ready for the session's missing shots; what an earlier run has found stays.

    pause_point: called between all steps, and may raise to end this. Raises CameraError, RigError,
    LinkError or SessionError.
    """
    pause_point()
    recovery.insist(rig.controller.home)
    if session.manifest.preset.exposure == "test" and not session.manifest.exposures:
        found = []
        for leds in dict.fromkeys(shot.leds for shot in session.manifest.plan):
            pause_point()
            lit = find_exposure(rig, recovery, leds, session.manifest.thickness_mm)
            publish(ExposureFound(lit.leds, lit.exposure_us, lit.clipped))
            found.append(lit)
        session.save_exposures(found)


def darks_missing(session: Session) -> Iterator[Exposure]:
    """The exposures of the plan that have no dark frame yet, each once."""
    asked = [Exposure(shot.exposure_us, shot.gain) for shot in session.manifest.plan]
    if session.manifest.preset.bracketing:
        asked += [shorter(exposure) for exposure in asked]
    return (e for e in dict.fromkeys(asked) if session.dark_record(e) is None)
