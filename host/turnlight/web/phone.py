"""The service behind the phone's page: photos in, verdicts and maps out."""

import asyncio
import io
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path as FilePath
from typing import Annotated, Any, Literal

import segno
from fastapi import FastAPI, Path, Query, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import FileResponse, JSONResponse
from fastapi.staticfiles import StaticFiles
from pydantic import BaseModel
from starlette.requests import ClientDisconnect

from turnlight.errors import ImageError, SessionError, TurnlightError
from turnlight.handheld.inbox import Inbox
from turnlight.handheld.verdict import Verdict
from turnlight.web.api import STATIC, MapName
from turnlight.web.door import Door, Guard, script_hashes
from turnlight.web.entrance import add_entrance
from turnlight.web.images import Images
from turnlight.web.orders import ExportOrder, exported
from turnlight.web.shapes import Answer, Problem
from turnlight.web.thumbnails import Thumbnails

LARGEST_UPLOAD = 150_000_000
"""In bytes; a raw photo of 50 million pixels has 100."""
_DRAINED = 4 * LARGEST_UPLOAD
"""How much of a larger one is listened to, so that its sender hears why not."""
LONGEST_WAIT_S = 20.0
_LOOK_EVERY_S = 0.1
Number = Annotated[int, Path(ge=1, le=100_000)]
Verb = Literal["force", "leave-out"]
_IMAGE: dict[int | str, dict[str, Any]] = {200: {"content": {"image/jpeg": {}}}}
_SVG: dict[int | str, dict[str, Any]] = {200: {"content": {"image/svg+xml": {}}}}
_FILE: dict[int | str, dict[str, Any]] = {200: {"content": {"application/octet-stream": {}}}}
_PROBLEMS: dict[int | str, dict[str, Any]] = {
    status: {"model": Problem} for status in (401, 403, 404, 409, 413, 421)
}


class PhotoShape(BaseModel):
    """A photo that was kept. sentences: what the checks found. warning: what else."""

    number: int
    name: str
    used: bool
    sentences: list[str]
    warning: str | None
    can_be_forced: bool


class ArrivalShape(BaseModel):
    """A file without a verdict."""

    number: int
    name: str
    turn: Literal["waiting", "checking", "refused"]
    sentence: str | None


class HandheldShape(BaseModel):
    """All that the page shows. maps: changes whenever the maps have; None before there are any."""

    version: int
    session: str
    sample: str
    photos: list[PhotoShape]
    arrivals: list[ArrivalShape]
    maps: int | None
    link: str
    largest_upload: int


def build(inbox: Inbox, door: Door, link: str) -> FastAPI:
    """The whole as an ASGI application; `inbox` must have been entered. link: what the QR code says."""
    api = FastAPI(
        title="Turnlight by hand",
        version="1.0",
        openapi_url="/api/openapi.json",
        docs_url=None,
        redoc_url=None,
        responses=_PROBLEMS,
    )
    add_entrance(api, door)
    _add_news(api, inbox, link)
    _add_photos(api, inbox)
    _add_maps(api, inbox)
    api.add_exception_handler(TurnlightError, _refused)
    page = STATIC / "phone.html"

    @api.get("/", include_in_schema=False)
    def root() -> FileResponse:
        return FileResponse(page)

    api.mount("/", StaticFiles(directory=STATIC))
    hashes = script_hashes(page.read_text(encoding="utf-8"))
    uploads = frozenset({"/api/photos"})
    api.add_middleware(Guard, door=door, scripts=hashes, uploads=uploads)
    return api


def _add_news(api: FastAPI, inbox: Inbox, link: str) -> None:
    def shape() -> HandheldShape:
        news = inbox.news
        return HandheldShape(
            version=news.version,
            session=inbox.folder.name,
            sample=inbox.sample,
            photos=[_photo(verdict) for verdict in news.verdicts],
            arrivals=[ArrivalShape.model_validate(vars(a)) for a in news.arrivals],
            maps=_stamp(inbox.folder / "maps/preview.png"),
            link=link,
            largest_upload=LARGEST_UPLOAD,
        )

    @api.get("/api/handheld")
    async def handheld(
        after: Annotated[int, Query(ge=-1, description="The version that is known already.")] = -1,
    ) -> HandheldShape:
        """As it is; if that is known already, as soon as it changes, or after some seconds."""
        until_s = time.monotonic() + LONGEST_WAIT_S
        while inbox.news.version == after and time.monotonic() < until_s:
            await asyncio.sleep(_LOOK_EVERY_S)
        return shape()

    @api.get("/api/link.svg", response_class=Response, responses=_SVG)
    def qr_code() -> Response:
        """The link as a QR code."""
        file = io.BytesIO()
        segno.make(link, error="m").save(file, kind="svg", border=4, light="white", scale=8)
        return Response(file.getvalue(), media_type="image/svg+xml")


def _add_photos(api: FastAPI, inbox: Inbox) -> None:
    thumbnails = Thumbnails(inbox.folder)
    verbs: dict[Verb, Callable[[int], object]] = {
        "force": inbox.force,
        "leave-out": inbox.leave_out,
    }

    @api.post("/api/photos", status_code=202)
    async def take(
        request: Request,
        name: Annotated[str, Query(max_length=1000, description="What the file is called.")] = "",
    ) -> Answer:
        """A photo, as the request's body; its verdict is among the news when its turn has come."""
        with suppress(ClientDisconnect):  # who has gone hears nothing
            await _save(request, inbox, name)
        return Answer()

    @api.post("/api/photos/{number}/{verb}")
    def change(number: Number, verb: Verb) -> Answer:
        """Use a photo in spite of its faults, or use it no more."""
        verbs[verb](number)
        return Answer()

    @api.post("/api/arrivals/{number}/dismiss")
    def dismiss(number: Number) -> Answer:
        """Forget a file that was refused."""
        inbox.dismiss(number)
        return Answer()

    @api.get("/api/photos/{number}.jpg", response_class=Response, responses=_IMAGE)
    def thumbnail(number: Number) -> Response:
        """A photo, small."""
        lasting = {"cache-control": "private, max-age=86400"}
        return Response(thumbnails.of(number), media_type="image/jpeg", headers=lasting)


async def _save(request: Request, inbox: Inbox, name: str) -> None:
    """Raises TooLargeError once the body has been heard, of which no more than is allowed is kept."""
    size = 0
    with inbox.receive(name) as file:
        async for part in request.stream():
            size += len(part)
            if size <= LARGEST_UPLOAD:
                await run_in_threadpool(file.write, part)
            elif size > _DRAINED:
                break
        if size > LARGEST_UPLOAD:
            raise TooLargeError(
                f"{name or 'The photo'} is too large; at most {LARGEST_UPLOAD // 1_000_000} MB can "
                "be sent. Save it as JPEG."
            )


def _add_maps(api: FastAPI, inbox: Inbox) -> None:
    """Under the same addresses as `turnlight.web.api` has them, for the same scripts."""
    images = Images()

    def folder_of(name: str) -> FilePath:
        if name != inbox.folder.name:
            raise SessionError("There is no such session here; open the page anew.")
        return inbox.folder

    @api.get("/api/sessions/{name}/maps/{which}.jpg", response_class=Response, responses=_IMAGE)
    def map_image(name: str, which: MapName) -> Response:
        """A map as a screen shows it, or the material relit."""
        return Response(images.of(folder_of(name), which), media_type="image/jpeg")

    @api.get("/api/sessions/{name}/packed", response_class=Response, responses=_FILE)
    def packed_maps(name: str) -> Response:
        """The maps for relighting, as `turnlight.export.pack.packed_for_a_screen` has them."""
        return Response(images.of(folder_of(name), "packed"), media_type="application/octet-stream")

    @api.post("/api/sessions/{name}/export", response_class=Response, responses=_FILE)
    def export_session(name: str, what: ExportOrder) -> Response:
        """The maps in another program's form: one file, a zip where the form is a folder."""
        file_name, content = exported(folder_of(name), what)
        told = {"content-disposition": f'attachment; filename="{file_name}"'}
        return Response(content, media_type="application/octet-stream", headers=told)


class TooLargeError(ImageError):
    """A photo is larger than can be sent."""


def _photo(verdict: Verdict) -> PhotoShape:
    return PhotoShape(
        number=verdict.number,
        name=verdict.name,
        used=verdict.used,
        sentences=[fault.sentence for fault in verdict.faults],
        warning=verdict.warning,
        can_be_forced=verdict.can_be_forced,
    )


def _stamp(path: FilePath) -> int | None:
    try:
        return path.stat().st_mtime_ns // 1000 % 2**52  # which a page's numbers hold
    except OSError:
        return None


def _refused(_: Request, error: Exception) -> Response:
    status = (
        404 if isinstance(error, SessionError) else 413 if isinstance(error, TooLargeError) else 409
    )
    return JSONResponse({"detail": str(error)}, status)
