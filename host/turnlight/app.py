"""The one place that builds a rig, real or simulated, and wires the parts."""

import contextlib
import hashlib
import platform
import re
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import metadata, resources
from pathlib import Path

from svbrdf import materials, procedural
from svbrdf.maps import Maps
from turnlight.capture import durable
from turnlight.capture.adaptive import first_shots
from turnlight.capture.contact_sheet import ContactSheet
from turnlight.capture.engine import Engine
from turnlight.capture.events import Event, Faulted, Finished, Interrupted, Refused
from turnlight.capture.manifest import Manifest, RefinementRecord
from turnlight.capture.refining import refine_session
from turnlight.capture.relight import relit
from turnlight.capture.run import Job
from turnlight.capture.session import Session, png_bytes, save_maps
from turnlight.capture.shooting import DROPPED
from turnlight.config import RigConfig
from turnlight.errors import ConfigError, ImageError, RigError, RunError
from turnlight.estimate.estimator import Estimator
from turnlight.export.provenance import Origin, Photo
from turnlight.handheld.aligned import load_aligned
from turnlight.handheld.folder import is_handheld
from turnlight.handheld.handheld import Handheld
from turnlight.handheld.record import HandheldManifest
from turnlight.handheld.refining import refine_handheld
from turnlight.handheld.verdict import Verdict
from turnlight.preset import Preset
from turnlight.rig.camera.camera import Camera
from turnlight.rig.camera.oak import OakCamera
from turnlight.rig.camera.uvc import UvcCamera
from turnlight.rig.clock import Clock, WallClock
from turnlight.rig.controller import Controller, Hello
from turnlight.rig.link import SerialLink
from turnlight.rig.rig import Rig
from turnlight.rig.usb import serial_port
from turnlight.simulation.board import BoardClock, SimulatedBoard, simulated_board
from turnlight.simulation.camera import SimulatedCamera
from turnlight.simulation.truth import as_built

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
    operator: str | None = None


def capture(
    config: RigConfig, sample: Sample, preset: Preset, out: Path | None
) -> Generator[Event, None, None]:
    """Capture a sample into a new session folder (default: under ./sessions), event by event.

    Close the iterator to stop early: the LEDs go off and the shots so far stay. Raises
    TurnlightError or svbrdf.materials.MaterialError.
    """
    yield from follow(new_job(config, sample, preset, out))


def resume(
    folder: Path, retake: Sequence[int] = (), drop: Sequence[int] = (), finish: bool = False
) -> Generator[Event, None, None]:
    """Go on with a session: take what is missing, or only finish it.

    retake, drop: numbers of shots, from 1, to be taken again or left out of the maps. Raises
    TurnlightError or svbrdf.materials.MaterialError.
    """
    yield from follow(old_job(folder, retake, drop, finish))


def new_engine() -> Engine:
    """An engine that builds the rigs that sessions name."""

    def rig_of(manifest: Manifest) -> contextlib.AbstractContextManager[Rig]:
        sample = Sample(manifest.sample, manifest.thickness_mm, manifest.material)
        return build_rig(manifest.config, sample)

    return Engine(rig_of, Estimator)


def new_job(config: RigConfig, sample: Sample, preset: Preset, out: Path | None) -> Job:
    """What an engine needs to capture a sample; nothing is written yet. Raises ConfigError."""
    if sample.material and config.camera.driver != SIMULATED:
        raise ConfigError("--material is for the simulated rig; leave it out for this one.")
    manifest = Manifest(
        sample=sample.name,
        barcode=sample.barcode,
        operator=sample.operator,
        thickness_mm=sample.thickness_mm,
        started=datetime.now(UTC),
        versions=_versions(),
        model_sha256=model_sha256(),
        config=config,
        material=sample.material.resolve() if sample.material else None,
        preset=preset,
        plan=first_shots(config, preset, sample.thickness_mm),
    )
    return Job(manifest, out or default_folder(sample.name))


def old_job(
    folder: Path, retake: Sequence[int] = (), drop: Sequence[int] = (), finish: bool = False
) -> Job:
    """What an engine needs to go on with a session. Raises SessionError or RunError."""
    session = Session.open(folder)
    count = len(session.manifest.plan)
    for number in (*retake, *drop):
        if not 1 <= number <= count:
            raise RunError(f"There is no shot {number}; {folder} has shots 1 to {count}.")
    for number in drop:
        session.drop(number - 1, DROPPED)
    indices = tuple(number - 1 for number in retake)
    return Job(session.manifest, folder, session, indices, finish)


def follow(job: Job) -> Generator[Event, None, None]:
    """Do a job, event by event; RunError when it ends before its time, by Ctrl-C for example."""
    go_on = f"Go on with: turnlight resume {job.folder}"
    with contextlib.closing(new_engine()) as engine:
        events = engine.subscribe()
        engine.start(job)
        try:
            for event in events:
                if isinstance(event, Refused):
                    raise RunError(event.cause)
                yield event
                if isinstance(event, Finished):
                    return
                if isinstance(event, Interrupted | Faulted):
                    raise RunError(f"{event} {go_on}")
        except KeyboardInterrupt as stop:
            engine.close()
            if engine.current.folder is None:
                raise RunError("Stopped, and nothing was written.") from stop
            safe = len(Session.open(job.folder).manifest.used)
            raise RunError(f"Stopped. {safe} shots safe. {go_on}") from stop


def refine(
    folder: Path, prior: bool, resolution: int, progress: Callable[[float], None]
) -> RefinementRecord:
    """Refine a session's maps under its known lights; progress is told the share that is done.

    prior: False for the classical optimisation. Raises SessionError, ImageError or ModelError.
    """
    refining = refine_handheld if is_handheld(folder) else refine_session
    return refining(folder, Estimator() if prior else None, resolution, progress)


def infer(images: Iterable[Path], name: str, out: Path | None) -> Finished:
    """Maps from photographs that are already rectified and square, in a new folder.

    The maps depend on the set of pictures alone, not on their order. Nothing is written unless every
    picture is good. Raises ImageError, ModelError or SessionError.
    """
    estimator = Estimator()
    sheet = ContactSheet(name)
    photos = []
    for path in images:
        picture = load_aligned(path)
        photos.append(Photo(file=path.name, sha256=hashlib.sha256(path.read_bytes()).hexdigest()))
        maps = estimator.add(picture)
        sheet.add(picture, maps)
    photos.sort(key=lambda photo: (photo.file, photo.sha256))
    origin = Origin(
        sample=name, versions=_versions(), model_sha256=model_sha256(), photos=tuple(photos)
    )
    folder = out or default_folder(name)
    durable.create_folder(folder)
    durable.create_folder(folder / "maps")
    save_maps(folder, maps, relit(maps))
    durable.write(folder / "origin.json", origin.model_dump_json(indent=2).encode())
    return Finished(folder, estimator.count, _save_sheet(sheet, folder))


def infer_framed(
    images: Iterable[Path],
    white: float,
    force: bool,
    plain_mm: int | None,
    out: Path | None,
    progress: Callable[[Path], None] = lambda _: None,
) -> tuple[Finished, tuple[Verdict, ...]]:
    """Maps from photographs in the printed frame, and what the checks say of each, in a new session.

    force: use every photo whose frame is found. plain_mm: side of the opening of a frame without markers,
    which is then looked for too. The maps depend on the set of photos alone. Raises
    ImageError, ModelError or SessionError; then nothing is written.
    """
    paths = list(images)
    for path in paths:
        if not path.is_file():
            raise ImageError(f"There is no file {path}; check the name.")
    handheld = new_handheld(paths[0].stem, white, out, plain_mm)
    try:
        verdicts = handheld.add(paths, progress)
    except ImageError:
        handheld.discard()
        raise
    if force:
        numbers = {v.number for v in verdicts if not v.used and v.can_be_forced}
        handheld.force(*sorted(numbers))
        verdicts = tuple(handheld.verdicts[v.number - 1] for v in verdicts)
    sheet = handheld.finish()
    return Finished(handheld.folder, len(handheld.manifest.used), sheet), verdicts


def new_handheld(
    sample: str, white: float, out: Path | None, plain_mm: int | None = None
) -> Handheld:
    """A new session for photos taken by hand in the printed frame. white: reflectance of its paper.

    Raises SessionError or ModelError.
    """
    manifest = HandheldManifest(
        sample=sample,
        started=datetime.now(UTC),
        versions=_versions(),
        model_sha256=model_sha256(),
        white=white,
        plain_mm=plain_mm,
    )
    return Handheld(out or default_folder(sample), manifest)


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
        camera = build_camera(config, sample, connection)
        with contextlib.closing(camera):
            firmware = connection.hello.firmware
            yield Rig(config, connection.controller, camera, connection.clock, firmware)


@contextlib.contextmanager
def connect(config: RigConfig) -> Iterator[Connection]:
    """The controller that the configuration names, greeted; closed, with its LEDs off, at the end.

    Raises LinkError when nothing answers, RigError when it is not what the configuration describes.
    """
    with contextlib.ExitStack() as parts:
        board = simulated_board(config.controller)
        if board:
            parts.enter_context(board)
        clock: Clock = BoardClock(board) if board else WallClock()
        port = board.port if board else serial_port(config.controller.port)
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


def build_camera(config: RigConfig, sample: Sample, connection: Connection) -> Camera:
    """The camera that the configuration names. Raises CameraError or ConfigError."""
    board, driver = connection.board, config.camera.driver
    if (driver == SIMULATED) != (board is not None):
        raise ConfigError(
            "Camera and controller are both simulated or both real; correct camera.driver or "
            "controller.port in the rig file."
        )
    if board is not None:
        seed = config.simulation.truth_seed if config.simulation else None
        truth = as_built(config, seed).config
        return SimulatedCamera(truth, _material(sample), sample.thickness_mm, board, NOISE_SEED)
    real = OakCamera if driver == "oak" else UvcCamera
    return real(config.camera, lambda: connection.controller.status().time_us)


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
    return materials.averaged(maps, min(*maps.resolution, SIMULATED_RESOLUTION))


def _save_sheet(sheet: ContactSheet, folder: Path) -> Path:
    path = folder / "contact_sheet.png"
    durable.write(path, png_bytes(sheet.draw()))
    return path


def _versions() -> dict[str, str]:
    packages = ("turnlight", "numpy", "onnxruntime", "opencv-contrib-python-headless")
    return {"python": platform.python_version()} | {p: metadata.version(p) for p in packages}
