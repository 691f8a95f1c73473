"""The page's own files, from memory: a page asks for many at once, and often when the rig is at work."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

from starlette.datastructures import Headers
from starlette.responses import JSONResponse, Response
from starlette.types import Receive, Scope, Send

INDEX = "index.html"
MEDIA_TYPES = {
    ".css": "text/css",
    ".html": "text/html",
    ".js": "text/javascript",
    ".svg": "image/svg+xml",
}


@dataclass(frozen=True)
class _Asset:
    content: bytes
    media_type: str
    etag: str


class Assets:
    """The files directly in `folder` as an ASGI application; `/` is its index.html."""

    def __init__(self, folder: Path) -> None:
        self._assets = {
            file.name: _read(file) for file in folder.iterdir() if file.suffix in MEDIA_TYPES
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "websocket":
            await receive()
            await send({"type": "websocket.close", "code": 1008, "reason": "Nobody talks here."})
            return
        await self._reply(scope)(scope, receive, send)

    def _reply(self, scope: Scope) -> Response:
        asset = self._assets.get(scope["path"].removeprefix("/") or INDEX)
        if asset is None:
            return JSONResponse({"detail": "There is nothing here."}, 404)
        if scope["method"] not in ("GET", "HEAD"):
            return JSONResponse({"detail": "This can be read, and no more."}, 405)
        told = {"etag": asset.etag}
        if Headers(scope=scope).get("if-none-match") == asset.etag:
            return Response(status_code=304, headers=told)
        return Response(asset.content, media_type=asset.media_type, headers=told)


def _read(file: Path) -> _Asset:
    content = file.read_bytes()
    return _Asset(
        content, MEDIA_TYPES[file.suffix], f'"{hashlib.sha256(content).hexdigest()[:24]}"'
    )
