"""A sample photographed by hand: photo after photo in, a verdict on each and better maps out.

The command line and the phone's page both drive this, and nothing else.
"""

from collections import OrderedDict
from collections.abc import Callable, Iterable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Self

import numpy as np

from svbrdf import materials
from svbrdf.maps import Maps
from turnlight.capture import durable
from turnlight.capture.contact_sheet import ContactSheet
from turnlight.capture.session import png_bytes
from turnlight.errors import RunError
from turnlight.estimate.estimator import Estimator
from turnlight.handheld import develop
from turnlight.handheld.align import features, misalignment
from turnlight.handheld.checks import faults, warning
from turnlight.handheld.develop import Look
from turnlight.handheld.finding import find_frame, find_plain
from turnlight.handheld.flash import Clue, flash_offset
from turnlight.handheld.folder import HandheldFolder
from turnlight.handheld.lens import View, fit_lens, plane_of
from turnlight.handheld.photo import Photo, read_photo
from turnlight.handheld.record import FrameRecord, HandheldManifest, LensRecord, PhotoRecord
from turnlight.handheld.sharpness import Blur, edge_blur
from turnlight.handheld.verdict import Verdict
from turnlight.picture.picture import Picture
from turnlight.picture.pinhole import Lens, Matrix, distort, project
from turnlight.picture.warp import Image

MOST_VIEWS = 12
"""Photos that a lens is measured from: more would say little new."""
MOST_COMPARED = 8
"""Photos that one is compared with for its detail."""
LENS_MOVED_PX = 0.2
"""A photo is straightened anew when its lens is known this much better."""
FLASH_MOVED_MM = 2.0
_PIXELS_IN_MEMORY = 40_000_000


class Handheld:
    """One sample's session folder. Not for several threads at once: the caller holds a lock."""

    def __init__(self, folder: Path, manifest: HandheldManifest) -> None:
        """Make the folder, which must not exist or be empty. Raises SessionError or ModelError."""
        self._attach(Estimator(), HandheldFolder(folder, manifest))

    @classmethod
    def open(cls, folder: Path) -> Self:
        """A folder that was made before, to go on with it. Raises SessionError or ModelError."""
        handheld = cls.__new__(cls)
        handheld._attach(Estimator(), HandheldFolder.open(folder))
        if (folder / "maps/normal.png").exists():
            handheld.maps = materials.load(folder / "maps")
        return handheld

    @property
    def folder(self) -> Path:
        return self._folder.path

    @property
    def manifest(self) -> HandheldManifest:
        return self._folder.manifest

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """On every photo so far, in their order. A later photo can change an earlier one's."""
        return tuple(photo.verdict for photo in self.manifest.photos)

    def add(
        self, paths: Iterable[Path], progress: Callable[[Path], None] = lambda _: None
    ) -> tuple[Verdict, ...]:
        """Keep photos (copied into photos/), check them, and make the maps anew; a verdict on each.

        Path.name is what the photo is called; a file that was kept before is not kept again. progress: told
        each photo once it has been looked at. Raises ImageError for a file that is no photo, and then none
        of them is kept.
        """
        known = {photo.sha256: photo for photo in self.manifest.photos}
        numbers = []
        new: list[PhotoRecord] = []
        files = []
        for path in paths:
            photo = read_photo(path)
            if photo.sha256 not in known:
                record = _looked_at(
                    photo, len(self.manifest.photos) + len(new) + 1, self.manifest.plain_mm
                )
                known[photo.sha256] = record
                new.append(record)
                files.append(path)
                self._remember(record.number, photo)
            numbers.append(known[photo.sha256].number)
            progress(path)
        kept = [
            record.model_copy(update={"file": self._folder.keep(path, record.number)})
            for record, path in zip(new, files, strict=True)
        ]
        if kept:
            self._settle((*self.manifest.photos, *kept))
        return tuple(self._record(number).verdict for number in numbers)

    def force(self, *numbers: int) -> tuple[Verdict, ...]:
        """Use photos in spite of what the checks found. Raises RunError where that cannot be done."""
        for number in numbers:
            if self._record(number).frame is None:
                raise RunError(
                    f"Photo {number} cannot be used: without the frame nobody knows where the sample is."
                )
        return self._change(numbers, forced=True, left_out=False)

    def leave_out(self, *numbers: int) -> tuple[Verdict, ...]:
        """Use photos no more; they stay in the folder."""
        return self._change(numbers, forced=False, left_out=True)

    def discard(self) -> None:
        """Take the folder away again, if no photo is in it."""
        if not self.manifest.photos:
            self._folder.remove()

    def finish(self) -> Path | None:
        """Note that no more photos come, and draw the contact sheet; None if no photo is used."""
        self._folder.update(finished=datetime.now(UTC))
        if not self.manifest.used or self.maps is None:
            return None
        sheet = ContactSheet(self.manifest.sample)
        estimator = Estimator()
        for record in self.manifest.used:
            picture = self._picture(record)
            sheet.add(picture, estimator.add(picture))
        path = self.folder / "contact_sheet.png"
        durable.write(path, png_bytes(sheet.draw()))
        return path

    def _attach(self, estimator: Estimator, folder: HandheldFolder) -> None:
        self._folder = folder
        self._estimator = estimator
        self._encoded: dict[int, object] = {}
        """What the estimator's pictures were made with, by number."""
        self._looks: dict[int, Look] = {}
        self._decoded: OrderedDict[int, Photo] = OrderedDict()
        self.maps: Maps | None = None
        """Of the photos used so far; also on disk, in maps/, after each photo."""

    def _record(self, number: int) -> PhotoRecord:
        photos = self.manifest.photos
        if not 1 <= number <= len(photos):
            raise RunError(f"There is no photo {number}; {self.folder} has 1 to {len(photos)}.")
        return photos[number - 1]

    def _change(self, numbers: Sequence[int], **changes: object) -> tuple[Verdict, ...]:
        chosen = {self._record(number).number for number in numbers}
        photos = self.manifest.photos
        self._settle(
            tuple(p.model_copy(update=changes) if p.number in chosen else p for p in photos)
        )
        return tuple(self._record(number).verdict for number in numbers)

    def _settle(self, photos: tuple[PhotoRecord, ...]) -> None:
        """All that follows from the set of photos: lenses, lights, verdicts, maps."""
        lit = self._with_flashes(self._with_lenses(photos))
        side = self.manifest.model_copy(update={"photos": tuple(lit)}).side_mm
        measured = [self._measured(photo, lit, side) for photo in lit]
        checked: list[PhotoRecord] = []
        for photo in measured:
            found = faults(photo, [p for p in checked if p.used], side)
            said = {"faults": found, "warning": warning(photo)}
            checked.append(photo.model_copy(update=said))
        self._folder.update(photos=tuple(self._aligned(checked)), finished=None, refinement=None)
        self._estimate()

    def _with_lenses(self, photos: Sequence[PhotoRecord]) -> list[PhotoRecord]:
        """With each device's lens as all its photos show it, and looked at through it."""
        lenses = {}
        for device in dict.fromkeys(map(_device, photos)):
            own = [p for p in photos if p.frame is not None and _device(p) == device]
            if own:
                chosen = sorted(own, key=lambda p: p.sha256)[:MOST_VIEWS]
                lenses[device] = LensRecord.of(fit_lens([_view(p) for p in chosen]))
        return [self._through(photo, lenses.get(_device(photo))) for photo in photos]

    def _through(self, photo: PhotoRecord, lens: LensRecord | None) -> PhotoRecord:
        if photo.frame is None or lens is None:
            return photo
        changed = photo.model_copy(update={"lens": lens})
        before = self._looks.get(photo.number)
        if before is None or _moved_px(changed, before.lens) > LENS_MOVED_PX:
            self._look(changed)
        return changed

    def _look(self, photo: PhotoRecord) -> Look:
        pixels = self._decoded.get(photo.number) or self._folder.read(photo)
        self._looks[photo.number] = seen = develop.look(pixels, photo)
        return seen

    def _with_flashes(self, photos: Sequence[PhotoRecord]) -> list[PhotoRecord]:
        """With where each device's flash is, as all its photos show it."""
        offsets: dict[object, Matrix] = {}
        for device in dict.fromkeys(map(_device, photos)):
            clues = []
            for photo in photos:
                seen = self._looks.get(photo.number)
                if _device(photo) == device and seen is not None and seen.lamp_mm is not None:
                    shine = develop.find_highlight(photo, seen)
                    clues.append(Clue(develop.pose(photo), seen.lamp_mm, shine))
            offsets[device] = flash_offset(clues)
        return [_with_flash(photo, offsets[_device(photo)]) for photo in photos]

    def _measured(
        self, photo: PhotoRecord, photos: Sequence[PhotoRecord], side_mm: int | None
    ) -> PhotoRecord:
        seen = self._looks.get(photo.number)
        if seen is None:
            return photo
        others = [
            self._looks[p.number]
            for p in photos
            if p.number != photo.number and p.frame is not None and p.frame.side_mm == side_mm
        ]
        lit = develop.shading(photo, seen)
        measured = develop.measure(photo, seen, lit, _spread(others, MOST_COMPARED))
        return photo.model_copy(update={"measured": measured})

    def _aligned(self, photos: Sequence[PhotoRecord]) -> list[PhotoRecord]:
        """With what is left between each picture and the one seen from straightest above."""
        used = [p for p in photos if p.used and p.measured is not None]
        if len(used) < 2:
            return list(photos)
        straight = max(
            used, key=lambda p: (p.measured.elevation_deg if p.measured else 0, -p.number)
        )
        reference = features(self._looks[straight.number].unwarped.light)
        return [
            self._shifted(p, reference) if p in used and p is not straight else p for p in photos
        ]

    def _shifted(self, photo: PhotoRecord, reference: Image) -> PhotoRecord:
        assert photo.frame is not None
        image = self._looks[photo.number].unwarped.light
        shift = misalignment(reference, features(image))
        if not shift.any():
            return photo
        step = photo.frame.side_mm / len(image) * np.array([1, -1])
        changed = photo.model_copy(
            update={"shift_mm": tuple(float(v) for v in photo.shift_mm + shift * step)}
        )
        self._look(changed)
        return changed

    def _picture(self, photo: PhotoRecord) -> Picture:
        seen = self._looks.get(photo.number) or self._look(photo)
        picture = develop.picture(photo, seen, develop.shading(photo, seen), self.manifest.white)
        return develop.without_light(picture) if not self.manifest.with_light else picture

    def _estimate(self) -> None:
        """The maps of the used photos; those encoded already stay, as long as nothing about them changes."""
        used = self.manifest.used
        lit = all(p.measured is not None and p.measured.light_mm is not None for p in used)
        if lit != self.manifest.with_light:
            self._folder.update(with_light=lit)
        wanted = {p.number: (id(self._looks[p.number]), p.flash_mm, lit) for p in used}
        if any(wanted.get(number) != made for number, made in self._encoded.items()):
            self._estimator.reset()
            self._encoded.clear()
        for photo in used:
            if photo.number not in self._encoded:
                self.maps = self._estimator.add(self._picture(photo))
                self._encoded[photo.number] = wanted[photo.number]
        if not used:
            self.maps = None
        elif self.maps is not None:
            self._folder.save_maps(self.maps)

    def _remember(self, number: int, photo: Photo) -> None:
        """Keep the last photos' pixels, as many as memory is meant for."""
        self._decoded[number] = photo
        while (
            len(self._decoded) > 1
            and sum(p.clipped.size for p in self._decoded.values()) > _PIXELS_IN_MEMORY
        ):
            self._decoded.popitem(last=False)


def _spread(looks: Sequence[Look], most: int) -> list[Look]:
    places = np.unique(np.linspace(0, len(looks) - 1, most).round().astype(int)) if looks else ()
    return [looks[place] for place in places]


def _looked_at(photo: Photo, number: int, plain_mm: int | None) -> PhotoRecord:
    green = np.ascontiguousarray(photo.pixels[..., 1])
    seen = find_frame(green)
    blur = Blur(0.0, 0.0) if seen is None else edge_blur(green, seen)
    if seen is None and plain_mm is not None:
        seen = find_plain(photo.pixels, plain_mm)
    height, width = green.shape
    return PhotoRecord(
        number=number,
        file="",
        name=photo.name,
        sha256=photo.sha256,
        device=photo.device,
        taken=photo.taken,
        width_px=width,
        height_px=height,
        focal_px=photo.focal_px,
        frame=None if seen is None else FrameRecord.of(seen, blur),
    )


def _with_flash(photo: PhotoRecord, offset: Matrix) -> PhotoRecord:
    if np.linalg.norm(offset - photo.flash_mm) <= FLASH_MOVED_MM:
        return photo
    return photo.model_copy(update={"flash_mm": tuple(map(float, offset))})


def _device(photo: PhotoRecord) -> object:
    """What has a lens of its own: a device, at one size and zoom."""
    sides = sorted((photo.width_px, photo.height_px))
    return photo.device, *sides, None if photo.focal_px is None else round(photo.focal_px)


def _view(photo: PhotoRecord) -> View:
    assert photo.frame is not None
    return View(photo.frame.sighting, photo.width_px, photo.height_px, photo.focal_px)


def _moved_px(photo: PhotoRecord, before: Lens) -> float:
    """How far the sample's points are from where they were with another lens."""
    assert photo.frame is not None and photo.lens is not None
    seen = photo.frame.sighting
    grid = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 5)] * 2), axis=-1) * seen.frame.side_mm
    now, then = (
        distort(lens, project(plane_of(seen, lens), grid))
        for lens in (photo.lens.lens(photo.width_px, photo.height_px), before)
    )
    return float(np.linalg.norm(now - then, axis=-1).max())
