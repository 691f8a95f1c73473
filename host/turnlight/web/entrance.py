"""How a page comes in: it trades the token for a cookie."""

from fastapi import FastAPI, Request, Response

from turnlight.web.door import Door
from turnlight.web.shapes import DoorShape, Token

_MONTH_S = 30 * 86400


def add_entrance(api: FastAPI, door: Door) -> None:
    """Serve the door at /api/door."""

    @api.get("/api/door")
    def look_at_door(request: Request) -> DoorShape:
        """Is the page let in? For everyone."""
        return DoorShape(open=door.let_in(request.headers), version=api.version)

    @api.post("/api/door")
    def enter(token: Token, request: Request, response: Response) -> DoorShape:
        """Trade the token for the page's cookie."""
        if not door.right_token(token.token):
            response.status_code = 401
            return DoorShape(open=False, version=api.version)
        response.set_cookie(
            door.cookie_name,
            door.cookie(),
            max_age=_MONTH_S,
            httponly=True,
            samesite="strict",
            secure=request.headers.get("x-forwarded-proto") == "https",
        )
        return DoorShape(open=True, version=api.version)
