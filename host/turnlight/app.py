"""The one place that builds a rig, real or simulated, and wires the parts."""

import contextlib
import hashlib
import platform
import re
from collections.abc import Generator, Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import metadata, resources
from pathlib import Path

from svbrdf import materials, procedural
from svbrdf.maps import Maps
from turnlight.capture import durable, sequencer
from turnlight.capture.contact_sheet import ContactSheet
from turnlight.capture.manifest import Manifest
from turnlight.capture.plan import plan, total_turn_deg
from turnlight.capture.relight import relit
from turnlight.capture.sequencer import Rig, ShotDone
from turnlight.capture.session import Session, png_bytes, save_maps
from turnlight.config import RigConfig
from turnlight.errors import CameraError, ConfigError, RigError
from turnlight.estimate.estimator import Estimator
from turnlight.picture.photo import load_aligned
from turnlight.rig.camera.camera import Camera
from turnlight.rig.clock import Clock, WallClock
from turnlight.rig.controller import Controller, Hello
from turnlight.rig.link import SerialLink
from turnlight.simulation.board import BoardClock, SimulatedBoard
from turnlight.simulation.camera import SimulatedCamera

DEFAULT_RIG = Path(__file__).parents[2] / "rig_config/simulated.toml"
SIMULATED = "simulated"
SIMULATED_SEED = 2_000_134
SIMULATED_RESOLUTION = 1024
NOISE_SEED = 0


@dataclass(frozen=True)
class Sample:
    """What lies on the table. material: the folder that gives the simulated rig its sample."""

    name: str
    thickness_mm: float
    material: Path | None = None
    barcode: str | None = None


@dataclass(frozen=True)
class Started:
    """The rig is there and the session's folder is made."""

    folder: Path
    count: int
    total_turn_deg: float


@dataclass(frozen=True)
class Finished:
    """Everything is on disk."""

    folder: Path
    count: int
    contact_sheet: Path


Event = Started | ShotDone | Finished


def capture(
    config: RigConfig, sample: Sample, shots: int, out: Path | None
) -> Generator[Event, None, None]:
    """Capture a sample into a new session folder (default: under ./sessions), event by event.

    Close the iterator to stop early: the LEDs go off and the shots so far stay. Raises
    TurnlightError or svbrdf.materials.MaterialError.
    """
    planned = plan(config, shots, sample.thickness_mm)
    if sample.material and config.camera.driver != SIMULATED:
        raise ConfigError("--material is for the simulated rig; leave it out for this one.")
    estimator = Estimator()
    with build_rig(config, sample) as rig:
        session = Session(
            out or default_folder(sample.name),
            Manifest(
                sample=sample.name,
                barcode=sample.barcode,
                thickness_mm=sample.thickness_mm,
                started=datetime.now(UTC),
                versions=_versions(),
                model_sha256=model_sha256(),
                config=config,
                plan=planned,
            ),
        )
        yield Started(session.folder, shots, total_turn_deg(s.angle_deg for s in planned))
        sheet = ContactSheet(sample.name)
        events = sequencer.run(rig, session, planned, sample.thickness_mm, estimator)
        with contextlib.closing(events):
            for event in events:
                sheet.add(event.picture, event.maps)
                yield event
    yield Finished(session.folder, shots, _save_sheet(sheet, session.folder))


def infer(images: Iterable[Path], name: str, out: Path | None) -> Finished:
    """Maps from photographs that are already rectified and square, in a new folder.

    The maps depend on the set of pictures alone, not on their order. Nothing is written unless every
    picture is good. Raises ImageError, ModelError or SessionError.
    """
    estimator = Estimator()
    sheet = ContactSheet(name)
    for path in images:
        picture = load_aligned(path)
        maps = estimator.add(picture)
        sheet.add(picture, maps)
    folder = out or default_folder(name)
    durable.create_folder(folder)
    durable.create_folder(folder / "maps")
    save_maps(folder, maps, relit(maps))
    return Finished(folder, estimator.count, _save_sheet(sheet, folder))


@dataclass(frozen=True)
class Connection:
    """A controller that has answered; `board` is what it runs on if that is simulated."""

    controller: Controller
    clock: Clock
    hello: Hello
    board: SimulatedBoard | None


@contextlib.contextmanager
def build_rig(config: RigConfig, sample: Sample) -> Iterator[Rig]:
    """The rig that the configuration describes; closed, with its LEDs off, at the end."""
    with connect(config) as connection:
        camera = build_camera(config, sample, connection.board)
        with contextlib.closing(camera):
            yield Rig(config, connection.controller, camera, connection.clock)


@contextlib.contextmanager
def connect(config: RigConfig) -> Iterator[Connection]:
    """The controller that the configuration names, greeted; closed, with its LEDs off, at the end.

    Raises LinkError when nothing answers, RigError when it is not what the configuration describes.
    """
    with contextlib.ExitStack() as parts:
        simulated = config.controller.port == SIMULATED
        board = parts.enter_context(SimulatedBoard()) if simulated else None
        clock: Clock = BoardClock(board) if board else WallClock()
        port = board.port if board else config.controller.port
        controller = Controller(SerialLink(port, config.controller.baud), clock)
        parts.callback(controller.close)
        hello = controller.hello()
        controller.clear()  # a host that died with light on has left a fault behind
        if hello.led_count != config.led_count:
            raise RigError(
                f"The controller has {hello.led_count} LEDs but the rig file describes "
                f"{config.led_count}; correct the count of each ring."
            )
        yield Connection(controller, clock, hello, board)


def build_camera(config: RigConfig, sample: Sample, board: SimulatedBoard | None) -> Camera:
    """The camera that the configuration names. Raises CameraError or ConfigError."""
    if config.camera.driver != SIMULATED:
        raise CameraError(
            f'This version has no driver for a camera of kind "{config.camera.driver}" yet; '
            'use a rig file with driver = "simulated".'
        )
    if board is None:
        raise ConfigError(
            'A simulated camera needs the simulated board; set port = "simulated" in the rig file.'
        )
    return SimulatedCamera(config, _material(sample), sample.thickness_mm, board, NOISE_SEED)


def default_folder(name: str) -> Path:
    """A new folder for a sample, under ./sessions."""
    slug = re.sub(r"[^\w.-]+", "-", name).strip("-.") or "sample"
    return Path("sessions") / f"{slug}-{datetime.now():%Y%m%d-%H%M%S}"


def simulated_material() -> Maps:
    """What lies on the simulated rig's table when no material is named."""
    return procedural.material(SIMULATED_SEED, SIMULATED_RESOLUTION)


def model_sha256() -> dict[str, str]:
    """Hash of every file of the shipped model."""
    files = (Path(str(f)) for f in (resources.files("svbrdf") / "weights").iterdir())
    return {f.name: hashlib.sha256(f.read_bytes()).hexdigest() for f in sorted(files)}


def _material(sample: Sample) -> Maps:
    if sample.material is None:
        return simulated_material()
    maps = materials.load(sample.material)
    return materials.reduced(maps, min(*maps.resolution, SIMULATED_RESOLUTION))


def _save_sheet(sheet: ContactSheet, folder: Path) -> Path:
    path = folder / "contact_sheet.png"
    durable.write(path, png_bytes(sheet.draw()))
    return path


def _versions() -> dict[str, str]:
    packages = ("turnlight", "numpy", "onnxruntime", "opencv-contrib-python-headless")
    return {"python": platform.python_version()} | {p: metadata.version(p) for p in packages}
