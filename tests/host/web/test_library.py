"""The folder of sessions that the page shows."""

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from turnlight.web import library as libraries
from turnlight.web.library import Library

MANY = 2 * libraries.AT_ONCE + 1


@pytest.fixture
def library(tmp_path: Path) -> Iterator[Library]:
    for number in range(MANY):
        folder = tmp_path / f"s{number:04}"
        folder.mkdir()
        manifest = {"sample": f"oak {number}", "started": f"2026-11-01T12:00:{number % 60:02}Z"}
        (folder / "session.json").write_text(json.dumps(manifest))
    with contextlib.closing(Library(tmp_path)) as opened:
        yield opened


def test_a_folder_that_is_new_is_shown_before_all_of_it_has_been_read(library: Library) -> None:
    first = library.search("", 0, 40)
    assert (len(first.entries), first.total, first.complete) == (40, libraries.AT_ONCE, False)
    assert not library.search("", 0, 40).complete
    last = library.search("", 0, 40)
    assert (last.total, last.complete) == (MANY, True)


def test_all_of_it_can_be_read_at_once(library: Library) -> None:
    library.read()
    found = library.search("oak 7", 0, 1)
    assert (len(found.entries), found.complete) == (1, True)
    assert found.total == sum("7" in str(number) for number in range(MANY))
    page = library.search("", 10, 5)
    assert page.total == MANY
    assert page.entries == library.search("", 0, 100).entries[10:15]


def test_the_latest_are_read_first(library: Library) -> None:
    new = library.root / "new"
    new.mkdir()
    (new / "session.json").write_text(
        json.dumps({"sample": "elm", "started": "2026-11-02T12:00:00Z"})
    )
    assert library.search("", 0, 1).entries[0].sample == "elm"
