"""The page's files: each as it is on disk, fetched again only when it has changed."""

import re

import pytest
from web_service import Served
from websockets.exceptions import InvalidHandshake
from websockets.sync.client import connect

from turnlight.web.api import STATIC
from turnlight.web.assets import MEDIA_TYPES


def test_each_file_is_served_as_it_is(served: Served) -> None:
    for file in STATIC.iterdir():
        status, content, told = served.ask("GET", f"/{file.name}")
        assert (status, content) == (200, file.read_bytes()), file
        assert told["content-type"].split(";")[0] == MEDIA_TYPES[file.suffix]
    assert served.ask("GET", "/")[1] == (STATIC / "index.html").read_bytes()


def test_what_a_page_has_already_is_not_sent_again(served: Served) -> None:
    _, _, told = served.ask("GET", "/app.js")
    assert told["cache-control"] == "no-cache"
    again = {"if-none-match": told["etag"]}
    assert served.ask("GET", "/app.js", headers=again)[:2] == (304, b"")
    assert served.ask("GET", "/dom.js", headers=again)[0] == 200


def test_they_can_be_read_and_no_more(served: Served) -> None:
    assert served.ask("HEAD", "/app.js")[:2] == (200, b"")
    assert served.ask("POST", "/app.js")[0] == 405
    assert served.ask("GET", "/static/app.js")[0] == 404
    with pytest.raises(InvalidHandshake), connect(f"ws://127.0.0.1:{served.port}/app.js"):
        pass


def test_a_page_starts_with_what_is_preloaded(served: Served) -> None:
    """What app.js imports at once is on its way before it has been read."""
    page = (STATIC / "index.html").read_text()
    script = (STATIC / "app.js").read_text()
    imported = re.findall(r'^import .* from "turnlight/(.*)";$', script, re.MULTILINE)
    assert len(imported) == 3
    for name in imported:
        assert f'<link rel="modulepreload" href="/{name}">' in page
