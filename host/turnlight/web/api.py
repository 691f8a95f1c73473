"""The service's routes: REST under /api, the event stream, and the page's files."""

import base64
from collections.abc import Callable
from pathlib import Path as FilePath
from typing import Annotated, Any, Literal

from fastapi import FastAPI, Path, Query, Request, Response
from fastapi.responses import JSONResponse
from pydantic import TypeAdapter

from svbrdf.materials import MaterialError
from turnlight.calibrate.printable import sheets
from turnlight.calibration import StepName
from turnlight.capture.events import Event
from turnlight.errors import SessionError, TurnlightError
from turnlight.web import shapes
from turnlight.web.assets import Assets
from turnlight.web.calibration import AtHand, CalibrationShape
from turnlight.web.desk import Desk
from turnlight.web.door import Door, Guard, script_hashes
from turnlight.web.entrance import add_entrance
from turnlight.web.looks import view
from turnlight.web.orders import ExportOrder, exported
from turnlight.web.refining import RefiningShape
from turnlight.web.sample import NextSample
from turnlight.web.stream import add_stream

API_VERSION = "1.3"
"""Raise it with every change of the schema: tests/host/web keeps the schema of each version."""
STATIC = FilePath(__file__).parent / "static"
Name = Annotated[str, Path(min_length=1, max_length=200, pattern=r"^[\w][\w.-]*$")]
Number = Annotated[int, Path(ge=1, le=100_000)]
ParameterName = Literal["normal", "diffuse", "roughness", "specular"]
MapName = Literal["normal", "diffuse", "roughness", "specular", "preview"]
Verb = Literal["pause", "resume", "stop", "stop-now", "dismiss"]
ShotVerb = Literal["retake", "drop"]
After = Annotated[int | None, Query(ge=1, le=100_000, description="As after so many pictures.")]
_PROBLEMS: dict[int | str, dict[str, Any]] = {
    status: {"model": shapes.Problem} for status in (401, 403, 404, 409, 413, 421)
}
_IMAGE: dict[int | str, dict[str, Any]] = {200: {"content": {"image/jpeg": {}}}}
_SESSION: dict[int | str, dict[str, Any]] = {200: {"model": shapes.SessionShape}}
_PDF: dict[int | str, dict[str, Any]] = {200: {"content": {"application/pdf": {}}}}
_FILE: dict[int | str, dict[str, Any]] = {200: {"content": {"application/octet-stream": {}}}}


def build(desk: Desk, door: Door) -> FastAPI:
    """The whole service as an ASGI application; `desk` must have been entered."""
    api = FastAPI(
        title="Turnlight",
        version=API_VERSION,
        openapi_url="/api/openapi.json",
        docs_url=None,
        redoc_url=None,
        responses=_PROBLEMS,
    )
    add_entrance(api, door)
    _add_rig(api, desk)
    _add_run(api, desk)
    _add_sessions(api, desk)
    _add_calibration(api, desk)
    add_stream(api, desk.engine, (desk.calibrator, desk.refiner))
    _add_events_to_schema(api)
    api.add_exception_handler(TurnlightError, _refused)
    api.add_exception_handler(MaterialError, _refused)
    api.mount("/", Assets(STATIC))
    page = (STATIC / "index.html").read_text(encoding="utf-8")
    api.add_middleware(Guard, door=door, scripts=script_hashes(page))
    return api


def _add_rig(api: FastAPI, desk: Desk) -> None:
    @api.get("/api/rig")
    def rig() -> shapes.RigShape:
        """The rig as configured."""
        return shapes.rig_shape(desk.config, desk.config.controller.simulated)

    @api.get("/api/ready")
    def ready() -> shapes.Ready:
        """The lights as last looked at."""
        desk.look_soon()
        return _ready(desk)

    @api.post("/api/ready")
    def look() -> shapes.Ready:
        """Look at all lights now; lights one LED."""
        desk.look()
        return _ready(desk)

    @api.get("/api/sample")
    def sample() -> NextSample:
        """What the next run captures."""
        return desk.next

    @api.put("/api/sample")
    def set_sample(sample: NextSample) -> NextSample:
        """Say what the next run captures; it is remembered."""
        desk.set_next(sample)
        return desk.next

    @api.get("/api/plan")
    def planned() -> shapes.PlanShape:
        """The shots that the next run would take."""
        return shapes.plan_shape(desk.plan())

    @api.post("/api/view")
    def look_through(led: Annotated[int, Query(ge=0, le=1000)] = 0) -> shapes.ViewShape:
        """A frame under one LED, the table at rest."""
        seen = desk.standby.look(lambda rig: view(rig, led, desk.next.thickness_mm))
        return shapes.view_shape(seen, base64.b64encode(seen.image).decode())


def _add_run(api: FastAPI, desk: Desk) -> None:
    engine = desk.engine
    verbs: dict[Verb, Callable[[], None]] = {
        "pause": engine.pause,
        "resume": engine.resume,
        "stop": engine.stop,
        "stop-now": engine.stop_now,
        "dismiss": engine.dismiss,
    }

    @api.get("/api/run")
    def run() -> shapes.RunShape:
        """The run now, and what may be asked of it."""
        now = engine.current
        session = now.folder.name if now.folder else None
        return shapes.RunShape(now=now, session=session, verbs=list(engine.verbs))

    @api.post("/api/run", status_code=202)
    def start() -> shapes.Answer:
        """Capture the next sample."""
        return shapes.Answer(session=desk.start())

    @api.post("/api/run/{verb}", status_code=202)
    def ask(verb: Verb) -> shapes.Answer:
        """Pause after this shot, go on, finish with what there is, halt at once, or leave the run."""
        verbs[verb]()
        return shapes.Answer()

    @api.post("/api/run/shots/{number}/{verb}", status_code=202)
    def ask_for_shot(number: Number, verb: ShotVerb) -> shapes.Answer:
        """Take a shot again, or let the maps do without it."""
        (engine.retake if verb == "retake" else engine.drop)(number)
        return shapes.Answer()


def _add_sessions(api: FastAPI, desk: Desk) -> None:
    library, images, reports = desk.library, desk.images, desk.reports

    @api.get("/api/sessions")
    def sessions(
        words: Annotated[str, Query(max_length=200)] = "",
        offset: Annotated[int, Query(ge=0, le=10_000_000)] = 0,
        limit: Annotated[int, Query(ge=1, le=200)] = 50,
    ) -> shapes.SessionList:
        """The newest first, those that have every word in name, folder or barcode."""
        found = library.search(words, offset, limit)
        lines = [shapes.line_shape(entry) for entry in found.entries]
        return shapes.SessionList(total=found.total, complete=found.complete, sessions=lines)

    @api.get("/api/sessions/{name}", responses=_SESSION)
    async def session(name: Name) -> Response:
        """What is known of a session, its shots or photos, and its maps."""
        return Response(await reports.soon(name), media_type="application/json")

    @api.delete("/api/sessions/{name}")
    def delete(name: Name) -> shapes.Answer:
        """Put a session aside; `restore` within a week brings it back."""
        desk.delete(name)
        return shapes.Answer(session=name)

    @api.post("/api/sessions/{name}/restore")
    def restore(name: Name) -> shapes.Answer:
        """Undo a deletion."""
        library.restore(name)
        return shapes.Answer(session=name)

    @api.post("/api/sessions/{name}/resume", status_code=202)
    def resume(name: Name, what: shapes.GoOn) -> shapes.Answer:
        """Go on with a session."""
        desk.go_on(name, what.retake, what.drop, what.finish)
        return shapes.Answer(session=name)

    @api.get("/api/refining")
    def refining() -> RefiningShape:
        """Which session is being refined, and how far that is."""
        return desk.refiner.now

    @api.post("/api/sessions/{name}/refine", status_code=202)
    def refine(name: Name) -> shapes.Answer:
        """Fit the maps to the photographs under the known lights, in the background."""
        desk.refine(name)
        return shapes.Answer(session=name)

    @api.get("/api/sessions/{name}/maps/{which}.jpg", response_class=Response, responses=_IMAGE)
    def map_image(name: Name, which: MapName, after: After = None) -> Response:
        """A map as a screen shows it, or the material relit."""
        image = images.of(_after(library.folder(name), after), which)
        return Response(image, media_type="image/jpeg")

    @api.get(
        "/api/sessions/{name}/uncertainty/{which}.jpg", response_class=Response, responses=_IMAGE
    )
    def doubt_image(name: Name, which: ParameterName) -> Response:
        """Where a refined map may be off, from black for hardly to yellow for `full`."""
        doubts = images.doubts(library.folder(name))
        if which not in doubts:
            raise SessionError("How far these maps may be off is not known; refine the session.")
        return Response(doubts[which].image, media_type="image/jpeg")

    @api.get("/api/sessions/{name}/packed", response_class=Response, responses=_FILE)
    async def packed_maps(name: Name, after: After = None) -> Response:
        """The maps for relighting, as `turnlight.export.pack.packed_for_a_screen` has them."""
        folder = _after(library.folder(name), after)
        return Response(await images.soon(folder, "packed"), media_type="application/octet-stream")

    @api.post("/api/sessions/{name}/export", response_class=Response, responses=_FILE)
    def export_session(name: Name, what: ExportOrder) -> Response:
        """The maps in another program's form: one file, a zip where the form is a folder."""
        file_name, content = exported(library.folder(name), what)
        told = {"content-disposition": f'attachment; filename="{file_name}"'}
        return Response(content, media_type="application/octet-stream", headers=told)

    @api.get("/api/sessions/{name}/shots/{number}.jpg", response_class=Response, responses=_IMAGE)
    def shot_image(name: Name, number: Number) -> Response:
        """What the camera saw, small; a photo, where the session was photographed by hand."""
        return Response(reports.picture(name, number), media_type="image/jpeg")


def _add_calibration(api: FastAPI, desk: Desk) -> None:
    calibrator = desk.calibrator

    @api.get("/api/calibration")
    def calibration() -> CalibrationShape:
        """The steps, what each needs on the table, and how each stands."""
        return calibrator.now

    @api.get("/api/calibration/picture.jpg", response_class=Response, responses=_IMAGE)
    def live_picture() -> Response:
        """The latest frame of the step that is being measured, or was last."""
        return Response(calibrator.picture(), media_type="image/jpeg")

    @api.get("/api/calibration/targets/{which}.pdf", response_class=Response, responses=_PDF)
    def target_to_print(which: Literal["board", "ball", "platter"]) -> Response:
        """A target, to be printed at 100 %, for what was said to be at hand last."""
        made = sheets(desk.config, calibrator.now.at_hand.targets())
        return Response(made[which].pdf(), media_type="application/pdf")

    @api.post("/api/calibration/stop", status_code=202)
    def stop() -> shapes.Answer:
        """Stop table and LEDs at once; the calibration stays as it was."""
        calibrator.stop()
        return shapes.Answer()

    @api.post("/api/calibration/{step}", status_code=202)
    def measure(step: StepName, at_hand: AtHand) -> shapes.Answer:
        """Measure a step, whose target is on the table."""
        desk.calibrate(step, at_hand)
        return shapes.Answer()


def _after(folder: FilePath, after: int | None) -> FilePath:
    return folder if after is None else folder / f"history/{after:03d}"


def _ready(desk: Desk) -> shapes.Ready:
    lights = desk.lights
    return shapes.Ready(
        ok=bool(lights) and all(light.ok for light in lights),
        looked=bool(lights),
        lights=list(lights),
    )


def _refused(_: Request, error: Exception) -> Response:
    status = 404 if isinstance(error, SessionError) else 409
    return JSONResponse({"detail": str(error)}, status)


def _add_events_to_schema(api: FastAPI) -> None:
    """The event stream's messages, which OpenAPI has no place for, among the schema's components."""
    plain = api.openapi

    def openapi() -> dict[str, Any]:
        if api.openapi_schema is None:
            schema = plain()
            adapter: TypeAdapter[Any] = TypeAdapter(Event)
            events = adapter.json_schema(
                mode="serialization", ref_template="#/components/schemas/{model}"
            )
            known = schema["components"]["schemas"]
            for name, shape in events.pop("$defs").items():
                known.setdefault(name, shape)
            known["Event"] = events
            messages = ["Event", CalibrationShape.__name__, RefiningShape.__name__]
            schema["x-event-stream"] = {"path": "/api/events", "messages": messages}
            api.openapi_schema = schema
        return api.openapi_schema

    api.openapi = openapi  # type: ignore[method-assign]
