"""The schema of each version is kept here: one that changes without a new version breaks who relies on it."""

import json
from pathlib import Path

from web_service import Served

from turnlight.web.api import API_VERSION

KEPT = Path(__file__).parent / f"openapi-{API_VERSION}.json"


def test_the_schema_is_that_of_its_version(served: Served) -> None:
    now = served.get("/api/openapi.json")
    assert now["info"]["version"] == API_VERSION
    text = json.dumps(now, indent=1, sort_keys=True) + "\n"
    if not KEPT.exists():
        KEPT.write_text(text)
        raise AssertionError(f"{KEPT.name} is new: look at it, and commit it.")
    assert text == KEPT.read_text(), (
        "The schema has changed: raise API_VERSION in turnlight/web/api.py, run this again and commit "
        "the new file."
    )


def test_the_schema_has_the_events(served: Served) -> None:
    schemas = served.get("/api/openapi.json")["components"]["schemas"]
    kinds = schemas["Event"]["discriminator"]["mapping"]
    assert {"snapshot", "state", "shot", "finished", "interrupted"} <= kinds.keys()
    assert all(reference.rsplit("/", 1)[1] in schemas for reference in kinds.values())
