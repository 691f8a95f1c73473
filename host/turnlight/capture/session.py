"""The session: one sample's folder, in which a shot is durable before anything else sees it.

session.json        the manifest: what was asked and with what, and a record of every shot on disk
shots/NNN.png       the camera's own bits; NNN.json the record of that shot
dark.png            the frame without LEDs, subtracted from every shot of the same exposure
maps/*.png          the maps after the last shot so far, 16-bit, linear; preview.png relights them
history/NNN/maps    what the maps were after NNN pictures, once the session is finished
contact_sheet.png   the whole capture at a glance

A shot taken again goes into shots/NNN-2.png, a shorter exposure of a bracketed shot into NNN-short.png,
and the dark frame of another exposure into dark-2.png: the records name their files.
"""

import hashlib
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Self

import cv2
import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from svbrdf import materials
from svbrdf.maps import Maps
from turnlight.capture import durable
from turnlight.capture.manifest import (
    FORMAT,
    FrameRecord,
    LitExposure,
    Manifest,
    RefinementRecord,
    ShotRecord,
    SkippedShot,
)
from turnlight.capture.plan import Shot
from turnlight.capture.png import encode16
from turnlight.errors import SessionError
from turnlight.frame import Exposure, Frame

DARKS_IN_MEMORY = 4


@dataclass(frozen=True)
class SavedShot:
    """A shot as it lies on disk. short: the shorter exposure of a bracketed shot."""

    record: ShotRecord
    frame: Frame
    short: Frame | None = None


class Session:
    """One capture's folder. Threads may share it; SessionError if the disk refuses."""

    def __init__(self, folder: Path, manifest: Manifest) -> None:
        """Make the folder, which must not exist or be empty."""
        durable.create_folder(folder)
        durable.create_folder(folder / "shots")
        durable.create_folder(folder / "maps")
        self._attach(folder, manifest)
        self._write_manifest()

    @classmethod
    def open(cls, folder: Path) -> Self:
        """A folder that an earlier capture has made, to read it or to go on with it."""
        session = cls.__new__(cls)
        session._attach(folder, _read_manifest(folder))
        return session

    def saved(self) -> Iterator[SavedShot]:
        """The shots that the maps are made of, in the order of the plan, one in memory at a time.

        Raises SessionError for a file that is missing or is not what was saved.
        """
        for index in [record.shot.index for record in self.manifest.used]:
            with self._lock:  # so that a shot which is just being replaced is read whole
                now = [r for r in self.manifest.used if r.shot.index == index]
                shots = [self.load(record) for record in now]
            yield from shots

    def load(self, record: ShotRecord) -> SavedShot:
        """One shot's frames."""
        short = self._load_frame(record.short) if record.short else None
        return SavedShot(record, self._load_frame(record.frame), short)

    def dark_record(self, exposure: Exposure) -> FrameRecord | None:
        """The frame without LEDs that was last taken at this exposure, if any was."""
        taken = (record for record in reversed(self.manifest.darks) if record.exposure == exposure)
        return next(taken, None)

    def dark_frame(self, record: FrameRecord) -> Frame:
        """A frame without LEDs; the last few stay in memory."""
        with self._lock:
            frame = self._darks.pop(record.image, None) or self._load_frame(record)
            self._keep_dark(record, frame)
        return frame

    def save_dark(self, frame: Frame) -> None:
        """Keep the frame without LEDs that holds for one exposure."""
        number = len(self.manifest.darks)
        record = self._save_frame(f"dark-{number + 1}.png" if number else "dark.png", frame)
        with self._lock:
            self._keep_dark(record, frame)
            self._update(darks=(*self.manifest.darks, record))

    def save_shot(
        self, shot: Shot, frame: Frame, reported_angle_deg: float, short: Frame | None = None
    ) -> ShotRecord:
        """Make a shot durable: its frames first, then its record, then the manifest.

        A shot saved before is replaced in the manifest; its old frames go when the new ones are safe.
        """
        name = f"shots/{shot.index:03d}"
        before = [r for r in self.manifest.shots if r.shot.index == shot.index]
        taken = {f.image for r in before for f in r.frames}
        number = 1
        while f"{name}.png" in taken:
            number += 1
            name = f"shots/{shot.index:03d}-{number}"
        record = ShotRecord(
            shot=shot,
            frame=self._save_frame(f"{name}.png", frame),
            short=self._save_frame(f"{name}-short.png", short) if short else None,
            reported_angle_deg=reported_angle_deg,
        )
        with self._lock:
            self.save_record(record)
            for image in taken:
                (self.folder / image).unlink(missing_ok=True)
        return record

    def save_record(self, record: ShotRecord) -> ShotRecord:
        """Replace what is known of a saved shot; one that was dropped meanwhile stays so."""
        index = record.shot.index
        path = self.folder / f"shots/{index:03d}.json"
        with self._lock:
            for known in self.manifest.shots:
                if known.frame == record.frame and known.dropped:
                    record = record.model_copy(update={"dropped": known.dropped})
            durable.write(path, record.model_dump_json(indent=2).encode())
            others = (r for r in self.manifest.shots if r.shot.index != index)
            skipped = tuple(s for s in self.manifest.skipped if s.index != index)
            self._update(shots=(*others, record), skipped=skipped)
        return record

    def save_exposures(self, exposures: Sequence[LitExposure]) -> None:
        """Keep what the exposure test found, and plan the shots so."""
        found = {e.leds: e.exposure_us for e in exposures}
        plan = tuple(
            replace(shot, exposure_us=found.get(shot.leds, shot.exposure_us))
            for shot in self.manifest.plan
        )
        self._update(exposures=tuple(exposures), plan=plan)

    def extend(self, shot: Shot) -> None:
        """Add a shot that has been chosen to the plan."""
        with self._lock:
            self._update(plan=(*self.manifest.plan, shot))

    def drop(self, index: int, cause: str) -> None:
        """Let the maps do without this shot from now on; its frames stay."""
        with self._lock:
            for record in self.manifest.shots:
                if record.shot.index == index:
                    self.save_record(record.model_copy(update={"dropped": cause}))

    def discard(self, index: int) -> None:
        """Forget a shot whose picture is of no use: it is missing again."""
        with self._lock:
            self._update(shots=tuple(r for r in self.manifest.shots if r.shot.index != index))

    def skip(self, index: int, cause: str) -> None:
        """Note that this shot gave no usable picture."""
        with self._lock:
            shots = tuple(r for r in self.manifest.shots if r.shot.index != index)
            others = (s for s in self.manifest.skipped if s.index != index)
            skipped = (*others, SkippedShot(index=index, cause=cause))
            self._update(shots=shots, skipped=skipped)

    def reopen(self) -> None:
        """Go on with a session: what was skipped is to be tried again."""
        if self.manifest.skipped or self.manifest.finished:
            self._update(skipped=(), finished=None)

    def save_maps(self, maps: Maps, preview: npt.NDArray[np.uint8]) -> None:
        """Replace the maps, each file at once; preview is (h, w, 3) RGB as a screen shows it."""
        save_maps(self.folder, maps, preview)

    def save_refinement(self, record: RefinementRecord) -> None:
        """Note that the maps on disk are refined, and how good they are."""
        self._update(refinement=record)

    def save_history(self, count: int, maps: Maps, preview: npt.NDArray[np.uint8]) -> None:
        """Keep the maps of the first `count` pictures beside those of all."""
        folder = self.folder / f"history/{count:03d}"
        (folder / "maps").mkdir(parents=True, exist_ok=True)
        save_maps(folder, maps, preview)

    def finish(self) -> None:
        """Note that every planned shot is in."""
        self._update(finished=datetime.now(UTC))

    def _attach(self, folder: Path, manifest: Manifest) -> None:
        self.folder = folder
        self.manifest = manifest
        self._lock = threading.RLock()
        self._darks: dict[str, Frame] = {}
        """By file, the last used last."""

    def _keep_dark(self, record: FrameRecord, frame: Frame) -> None:
        self._darks[record.image] = frame
        if len(self._darks) > DARKS_IN_MEMORY:
            del self._darks[next(iter(self._darks))]

    def _save_frame(self, name: str, frame: Frame) -> FrameRecord:
        digest = hashlib.sha256()

        def hashed() -> Iterator[bytes]:
            for chunk in encode16(frame.pixels):
                digest.update(chunk)
                yield chunk

        durable.write(self.folder / name, hashed())
        return FrameRecord(
            image=name,
            sha256=digest.hexdigest(),
            bit_depth=frame.bit_depth,
            gamma=frame.gamma,
            exposure=frame.exposure,
            started_us=frame.started_us,
        )

    def _load_frame(self, record: FrameRecord) -> Frame:
        path = self.folder / record.image
        try:
            png = path.read_bytes()
        except OSError as error:
            raise _lost(path, "cannot be read") from error
        if hashlib.sha256(png).hexdigest() != record.sha256:
            raise _lost(path, "is not the file that was saved")
        pixels = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)
        assert pixels is not None
        return Frame(
            pixels=np.ascontiguousarray(pixels[..., ::-1]),
            bit_depth=record.bit_depth,
            gamma=record.gamma,
            exposure=record.exposure,
            started_us=record.started_us,
        )

    def _update(self, **changes: object) -> None:
        with self._lock:
            self.manifest = self.manifest.model_copy(update=changes)
            self._write_manifest()

    def _write_manifest(self) -> None:
        content = self.manifest.model_dump_json(indent=2).encode()
        durable.write(self.folder / "session.json", content)


def save_maps(folder: Path, maps: Maps, preview: npt.NDArray[np.uint8]) -> None:
    """Write maps/*.png under the folder, each file replaced at once."""
    for name, png in materials.encode(maps).items():
        durable.write(folder / f"maps/{name}.png", png)
    durable.write(folder / "maps/preview.png", png_bytes(preview))


def png_bytes(image: npt.NDArray[np.uint8]) -> bytes:
    """(h, w, 3) RGB as PNG."""
    return bytes(cv2.imencode(".png", image[..., ::-1])[1])


def _read_manifest(folder: Path) -> Manifest:
    path = folder / "session.json"
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise SessionError(
            f"{folder} is not a session: its session.json cannot be read; name the folder that a "
            "capture has made."
        ) from error
    try:
        manifest = Manifest.model_validate_json(text)
    except ValidationError as error:
        place = ".".join(map(str, error.errors()[0]["loc"])) or "it is not JSON"
        raise SessionError(
            f"{path} is damaged ({place}); restore it from a copy, or capture the sample again."
        ) from error
    if manifest.format != FORMAT:
        raise SessionError(
            f"{path} has format {manifest.format} and this program reads {FORMAT}; "
            "use the program that made it."
        )
    return manifest


def _lost(path: Path, what: str) -> SessionError:
    return SessionError(
        f"{path} {what}; restore it from a copy, or take that shot again with turnlight resume."
    )
