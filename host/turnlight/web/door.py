"""The door: what every request must pass before anything else sees it.

Who may come in (Host, Origin, token), how much they may bring, and what a browser may do with the answer.
"""

import base64
import hashlib
import hmac
import ipaddress
import re
import secrets
import socket
from collections.abc import Iterable
from dataclasses import dataclass, field
from http.cookies import CookieError, SimpleCookie
from pathlib import Path

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from turnlight.errors import ServiceError

LARGEST_BODY = 64 * 1024
LARGEST_MESSAGE = 4 * 1024
SHORTEST_TOKEN = 16
_SAFE = frozenset({"GET", "HEAD", "OPTIONS"})
_HEADERS = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=()",
}
_WITHOUT_TOKEN = ("/api/door", "/api/openapi.json")


def own_names() -> frozenset[str]:
    """Names under which this computer is known on its own network."""
    name = socket.gethostname().lower()
    return frozenset({"localhost", name, f"{name}.local"})


@dataclass(frozen=True)
class Door:
    """Who may come in.

    token: what a script or a page must show; None lets everyone in who reaches the port, which is for
    loopback. names: host names under which we may be addressed, besides any IP address: a name that is
    not ours has been rebound to our address by someone else. cookie_name: of the page's cookie; a browser
    keeps one jar for all ports of a computer.
    """

    token: str | None = None
    names: frozenset[str] = field(default_factory=own_names)
    cookie_name: str = "turnlight"

    def known_host(self, host: str | None) -> bool:
        """Is this Host header one of ours?"""
        name = _name(host)
        return name is not None and (name in self.names or _is_address(name))

    def same_origin(self, origin: str | None, host: str | None) -> bool:
        """Does a request come from our own page, or from no page at all?"""
        return origin is None or re.sub(r"^https?://", "", origin) == host

    def cookie(self) -> str:
        """What a page carries in place of the token, and what is worth nothing to find the token."""
        return hmac.new((self.token or "").encode(), b"turnlight page", hashlib.sha256).hexdigest()

    def right_token(self, offered: str) -> bool:
        return self.token is None or hmac.compare_digest(offered.encode(), self.token.encode())

    def let_in(self, headers: Headers) -> bool:
        """Does the request show the token, or the page's cookie?"""
        if self.token is None:
            return True
        scheme, _, offered = headers.get("authorization", "").partition(" ")
        if scheme.lower() == "bearer" and self.right_token(offered.strip()):
            return True
        return hmac.compare_digest(
            _cookie_of(headers, self.cookie_name).encode(), self.cookie().encode()
        )


class Guard:
    """The door as ASGI middleware: HTTP and WebSocket alike."""

    def __init__(
        self, app: ASGIApp, door: Door, scripts: str = "", uploads: frozenset[str] = frozenset()
    ) -> None:
        """scripts: hashes of the page's inline scripts, as a content-security policy has them.

        uploads: paths that take what is large, piece by piece, and see to its size themselves.
        """
        self._app = app
        self._door = door
        self._uploads = uploads
        self._headers = _HEADERS | {
            "content-security-policy": f"default-src 'none'; script-src 'self' {scripts}; "
            "style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; font-src 'self'; "
            "manifest-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        }

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        refusal = self._refusal(scope, headers)
        if scope["type"] == "websocket":
            if refusal:
                await receive()
                await send({"type": "websocket.close", "code": 1008, "reason": refusal[1]})
            else:
                await self._app(scope, receive, send)
            return

        async def send_sealed(message: Message) -> None:
            if message["type"] == "http.response.start":
                sealed = MutableHeaders(scope=message)
                for name, value in self._headers.items():
                    sealed[name] = value
                sealed.setdefault("cache-control", "no-cache")
            await send(message)

        if refusal:
            status, sentence = refusal
            await JSONResponse({"detail": sentence}, status)(scope, receive, send_sealed)
            return
        if scope["path"] in self._uploads:
            await self._app(scope, receive, send_sealed)
            return
        body = await _read(receive) if scope["method"] not in _SAFE else b""
        if body is None:
            sentence = f"A request may bring {LARGEST_BODY // 1024} KiB and no more."
            await JSONResponse({"detail": sentence}, 413)(scope, receive, send_sealed)
            return
        await self._app(scope, _replay(body, receive), send_sealed)

    def _refusal(self, scope: Scope, headers: Headers) -> tuple[int, str] | None:
        host, path = headers.get("host"), scope["path"]
        if not self._door.known_host(host):
            return 421, "This name is not ours; use the computer's address, or start with --name."
        changes = scope["type"] == "websocket" or scope["method"] not in _SAFE
        if changes and not self._door.same_origin(headers.get("origin"), host):
            return 403, "Another site's page may not do this; open the page of this rig."
        needs_token = path.startswith("/api/") and path not in _WITHOUT_TOKEN
        if needs_token and not self._door.let_in(headers):
            return 401, "The token is missing or wrong; enter it on the page."
        return None


def is_loopback(host: str) -> bool:
    """Can this address be reached from this computer alone?"""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def token_for(host: str, file: Path | None) -> str | None:
    """The token to ask for: the file's, made if there is none yet; None for loopback without a file.

    Raises ServiceError if a network address has no file, or the file cannot be used.
    """
    if file is None:
        if is_loopback(host):
            return None
        raise ServiceError(
            f"On the network ({host}) the page needs a token; name a file for it with --token-file."
        )
    try:
        if not file.exists():
            file.touch(mode=0o600)
            file.write_text(secrets.token_urlsafe(24) + "\n")
        token = file.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise ServiceError(f"Cannot use the token file {file}; choose another.") from error
    if len(token) < SHORTEST_TOKEN:
        raise ServiceError(
            f"The token in {file} is shorter than {SHORTEST_TOKEN} letters; delete the file, and a "
            "good one is made."
        )
    return token


def script_hashes(page: str) -> str:
    """Of the scripts that stand in an HTML page itself, for `Guard`."""
    inline = re.findall(r"<script type=\"importmap\">(.*?)</script>", page, re.DOTALL)
    digests = (hashlib.sha256(text.encode()).digest() for text in inline)
    return " ".join(f"'sha256-{base64.b64encode(d).decode()}'" for d in digests)


async def _read(receive: Receive) -> bytes | None:
    """The whole body; None if it is too large."""
    parts: list[bytes] = []
    size = 0
    while True:
        message = await receive()
        if message["type"] != "http.request":
            return b"".join(parts)
        parts.append(message.get("body", b""))
        size += len(parts[-1])
        if size > LARGEST_BODY:
            return None
        if not message.get("more_body"):
            return b"".join(parts)


def _replay(body: bytes, receive: Receive) -> Receive:
    messages: Iterable[Message] = iter([{"type": "http.request", "body": body, "more_body": False}])

    async def replay() -> Message:
        for message in messages:
            return message
        return await receive()

    return replay


def _name(host: str | None) -> str | None:
    match = re.fullmatch(r"(\[[0-9a-f:.]+\]|[a-z0-9_.-]+)(?::\d{1,5})?", (host or "").lower())
    return match.group(1).strip("[]") if match else None


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _cookie_of(headers: Headers, name: str) -> str:
    try:
        morsel = SimpleCookie(headers.get("cookie", "")).get(name)
    except CookieError:
        return ""
    return morsel.value if morsel else ""
