"""What a page is told of a session: kept until its folder changes, and of photos taken by hand too."""

import contextlib
import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from web_service import in_a_loop, photographed_by_hand

from turnlight.errors import SessionError
from turnlight.web.images import Images
from turnlight.web.library import Library
from turnlight.web.reports import Reports


@pytest.fixture
def reports(tmp_path: Path) -> Iterator[Reports]:
    with contextlib.closing(Library(tmp_path)) as library:
        yield Reports(library, Images())


def test_photos_taken_by_hand_are_told_of(reports: Reports, tmp_path: Path) -> None:
    photographed_by_hand(tmp_path / "oak")
    told = json.loads(reports.of("oak"))
    assert (told["sample"], told["shots"], told["has_maps"]) == ("Oak by hand", [], True)
    assert [photo["used"] for photo in told["photos"]] == [True, False]
    assert told["photos"][1]["reasons"] == ["It is blurred; hold the phone still."]
    assert reports.picture("oak", 1)[:3] == b"\xff\xd8\xff"
    with pytest.raises(SessionError, match="no picture 3"):
        reports.picture("oak", 3)


def test_a_report_is_kept_until_the_folder_changes(reports: Reports, tmp_path: Path) -> None:
    photographed_by_hand(tmp_path / "oak")
    first = reports.of("oak")
    assert in_a_loop(reports.soon("oak")) is first
    file = tmp_path / "oak/session.json"
    file.write_text(file.read_text().replace("Oak by hand", "Elm by hand"))
    assert json.loads(reports.of("oak"))["sample"] == "Elm by hand"


def test_what_is_damaged_is_told(reports: Reports, tmp_path: Path) -> None:
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken/session.json").write_text("{")
    with pytest.raises(SessionError, match="damaged"):
        reports.of("broken")
    with pytest.raises(SessionError, match="no such session"):
        in_a_loop(reports.soon("none"))
