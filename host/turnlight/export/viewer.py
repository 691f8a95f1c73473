"""The relighting viewer as one HTML file that needs nothing else, to be mailed."""

import base64
import contextlib
import html as markup
import json
import math
import string
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import cv2
import numpy as np

from svbrdf import renderer
from svbrdf.maps import Maps
from turnlight.capture.develop import Developer
from turnlight.capture.session import SavedShot, Session
from turnlight.errors import ImageError
from turnlight.estimate.estimator import Estimator
from turnlight.export.pack import packed
from turnlight.export.provenance import GENERATOR, Provenance
from turnlight.export.subject import Subject
from turnlight.handheld.refining import developed
from turnlight.picture.picture import Picture

STATIC = Path(__file__).parents[1] / "web/static"
MODULES = ("brdf.js", "camera.js", "maps.js", "relight.js", "viewer.js")
MOST_PHOTOS = 6
PHOTO_PX = 512
WHITE_GRID = 24
_GAMMA = 2.2
_BRIGHT_STOPS = 2.0
_FLOOR = 0.02
_Record = TypeVar("_Record")


@dataclass(frozen=True)
class _Shot:
    name: str
    picture: Picture


def html(subject: Subject, *, tiles: bool) -> bytes:
    """The file. From a session: with some of its photos, and the maps before.

    Those are what the network made of all photos where the maps have been refined since, else what the
    first photo alone had given. Tiles do not lie on the photos, and go without.
    """
    shots = [] if tiles else _shots(subject)
    before = _before(subject, shots) if shots else None
    refined = _refined(subject)
    side_mm = subject.provenance.side_mm
    content = {
        "maps": packed(subject.maps),
        "before": packed(before) if before else None,
        "beforeName": "Before refinement" if refined else "After one photo",
        "afterName": "Refined" if refined else "After all photos",
        "photos": [entry for shot in shots if (entry := _photo(shot, subject.maps))],
        "halfSideMm": side_mm / 2 if side_mm else None,
        "tiles": tiles,
        "stops": _stops(subject.maps),
    }
    page = string.Template((STATIC / "viewer.html").read_text(encoding="utf-8"))
    text = page.substitute(
        generator=GENERATOR,
        title=markup.escape(subject.provenance.sample),
        subtitle=markup.escape(_subtitle(subject)),
        style=(STATIC / "viewer.css").read_text(encoding="utf-8"),
        scale="" if side_mm else "hidden",
        facts=_facts(subject),
        provenance=_script(subject.provenance.as_dict()),
        content=_script(content),
        modules=_script({"imports": {f"turnlight/{name}": _inline(name) for name in MODULES}}),
    )
    return text.encode()


def _shots(subject: Subject) -> list[_Shot]:
    """Up to MOST_PHOTOS of one lamp each, spread over the session, the first among them."""
    if subject.handheld is not None:
        folder = subject.handheld
        return [
            _Shot(f"Photo {photo.number}", developed(folder, photo.number, PHOTO_PX))
            for photo in _spread(folder.manifest.used)
        ]
    return _rig_shots(subject.session) if subject.session is not None else []


def _rig_shots(session: Session) -> list[_Shot]:
    single = [record for record in session.manifest.used if len(record.shot.leds) == 1]
    found = []
    developer = Developer(session, PHOTO_PX)
    for record in _spread(single):
        saved: SavedShot = session.load(record)
        try:
            picture = developer.develop(saved).picture
        except ImageError:
            continue  # the maps do without it too
        angle = record.shot.angle_deg
        found.append(_Shot(f"Table at {angle:g}°, LED {record.shot.leds[0]}", picture))
    return found


def _spread(records: Sequence[_Record]) -> list[_Record]:
    places = np.linspace(0, len(records) - 1, MOST_PHOTOS).round().astype(int)
    return [records[place] for place in np.unique(places)] if records else []


def _refined(subject: Subject) -> bool:
    captured = subject.session or subject.handheld
    return captured is not None and captured.manifest.refinement is not None


def _before(subject: Subject, shots: list[_Shot]) -> Maps | None:
    """None if the maps would not lie on the others."""
    estimator = Estimator()
    if not _refined(subject):
        maps = estimator.add(shots[0].picture)
    for picture in _pictures(subject) if _refined(subject) else ():
        maps = estimator.add(picture)
    (height, width), (rows, columns) = maps.resolution, subject.maps.resolution
    return maps if height * columns == width * rows else None


def _pictures(subject: Subject) -> Iterator[Picture]:
    """Every picture that the maps are made of."""
    if subject.handheld is not None:
        for photo in subject.handheld.manifest.used:
            yield developed(subject.handheld, photo.number, PHOTO_PX)
    if subject.session is not None:
        developer = Developer(subject.session, PHOTO_PX)
        for saved in subject.session.saved():
            with contextlib.suppress(ImageError):
                yield developer.develop(saved).picture


def _photo(shot: _Shot, maps: Maps) -> dict[str, Any] | None:
    lighting = shot.picture.lighting
    if lighting is None:
        return None
    [light] = lighting.lights
    image = cv2.resize(shot.picture.image, (PHOTO_PX, PHOTO_PX), interpolation=cv2.INTER_AREA)
    coded = np.rint(np.clip(image, 0, 1) ** (1 / _GAMMA) * 255).astype(np.uint8)
    options = [cv2.IMWRITE_JPEG_QUALITY, 90, cv2.IMWRITE_JPEG_SAMPLING_FACTOR, 0x111111]
    jpeg = bytes(cv2.imencode(".jpg", coded[..., ::-1], options)[1])
    white = np.broadcast_to(light.white, (*light.white.shape[:2], 3))
    if white.shape[0] > 1:
        grid = cv2.resize(white, (WHITE_GRID, WHITE_GRID), interpolation=cv2.INTER_AREA)
        white = np.asarray(grid, np.float32)
    return {
        "name": shot.name,
        "image": "data:image/jpeg;base64," + base64.b64encode(jpeg).decode(),
        "light": light.position.tolist(),
        "view": lighting.view.tolist(),
        "white": np.round(white.ravel().astype(float), 5).tolist(),
        "whiteSize": white.shape[0],
        "fit": _fit(shot.picture, maps),
    }


def _fit(picture: Picture, maps: Maps) -> float:
    """The factor that brings the relit maps to the photo's exposure, which uncalibrated maps cannot know."""
    assert picture.lighting is not None
    [light] = picture.lighting.lights
    size = maps.resolution[::-1]
    image = cv2.resize(picture.image, size, interpolation=cv2.INTER_AREA)
    white = light.white
    if white.shape[0] > 1:
        white = np.asarray(cv2.resize(white, size, interpolation=cv2.INTER_AREA), np.float32)
    white = white.reshape(*white.shape[:2], -1)
    seen = renderer.render(maps, light.position, picture.lighting.view, math.pi * white)
    ratio = np.log(image.clip(0) + _FLOOR) - np.log(np.asarray(seen) + _FLOOR)
    fit = math.exp(float(np.median(ratio[(image < 1).all(axis=-1)])))
    return round(fit, 4) if math.isfinite(fit) else 1.0


def _stops(maps: Maps) -> float:
    """Exposure at which a dark material is seen well, in whole quarters of stops."""
    seen = float(np.median((maps.diffuse + 0.5 * maps.specular).mean(axis=-1)))
    return float(np.clip(round(4 * np.log2(0.35 / max(seen, 1e-3))) / 4, -0.5, _BRIGHT_STOPS))


def _subtitle(subject: Subject) -> str:
    rows, columns = subject.maps.resolution
    parts = [f"{columns} × {rows} px"]
    if subject.size_mm:
        parts.insert(0, "{:g} × {:g} mm".format(*(round(side, 2) for side in subject.size_mm)))
    captured = subject.session or subject.handheld
    shots = len(captured.manifest.used) if captured else 0
    if shots:
        parts.append("1 photo" if shots == 1 else f"{shots} photos")
    return " · ".join(parts)


def _facts(subject: Subject) -> str:
    source: Provenance = subject.provenance
    rows = [("Made by", GENERATOR), ("What is seen", _subtitle(subject))]
    rows += [
        (key.replace("_", " ").capitalize(), str(value)) for key, value in source.about.items()
    ]
    rows += [("Done to it", ", ".join(str(step["step"]) for step in source.steps) or "nothing")]
    if source.versions:
        rows.append(("Versions", ", ".join(f"{k} {v}" for k, v in source.versions.items())))
    listed = [f"{markup.escape(k)} &nbsp;{v}" for k, v in source.model_sha256.items()]
    hashes = {
        "Model (SHA-256)": listed,
        "Photos (SHA-256)": [f"{markup.escape(p.file)} &nbsp;{p.sha256}" for p in source.photos],
    }
    text = [f"<dt>{markup.escape(k)}</dt><dd>{markup.escape(v)}</dd>" for k, v in rows]
    text += [f"<dt>{k}</dt><dd class=hashes>{'<br>'.join(v)}</dd>" for k, v in hashes.items() if v]
    return "\n".join(text)


def _inline(name: str) -> str:
    return "data:text/javascript;base64," + base64.b64encode((STATIC / name).read_bytes()).decode()


def _script(content: object) -> str:
    """JSON that may stand in a script element."""
    return json.dumps(content, ensure_ascii=False, separators=(",", ":")).replace("</", "<\\/")
