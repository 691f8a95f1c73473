"""The catalogue finds sessions by name, barcode and date, fast, and never knows more than the folders."""

import json
import shutil
import sqlite3
import statistics
import time
from collections.abc import Callable
from datetime import UTC, date, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from turnlight.catalogue import INDEX, Catalogue
from turnlight.errors import SessionError

NOON = datetime(2026, 11, 22, 12, tzinfo=UTC)


def write_session(root: Path, name: str, **fields: Any) -> Path:
    folder = root / name
    folder.mkdir(parents=True, exist_ok=True)
    manifest = {
        "sample": name, "started": NOON.isoformat(), "finished": None,
        "plan": [{"index": i} for i in range(12)],
        "shots": [{"shot": {"index": i}} for i in range(7)],
        "config": {"ignored": True},
    } | fields  # fmt: skip
    (folder / "session.json").write_text(json.dumps(manifest))
    return folder


def names(catalogue: Catalogue, *arguments: Any, **keywords: Any) -> list[str]:
    return [entry.folder.name for entry in catalogue.search(*arguments, **keywords)]


def test_an_entry_says_what_the_folder_says(tmp_path: Path) -> None:
    folder = write_session(tmp_path, "oak", barcode="4006381333931")
    with Catalogue(tmp_path) as catalogue:
        (entry,) = catalogue.search()
        assert (entry.folder, entry.sample, entry.barcode) == (folder, "oak", "4006381333931")
        assert (entry.started, entry.finished) == (NOON, None)
        assert (entry.planned, entry.saved, entry.problem) == (12, 7, None)
        assert entry.state == "interrupted at 7/12"
        write_session(tmp_path, "oak", finished=(NOON + timedelta(minutes=5)).isoformat())
        (entry,) = catalogue.search()
        assert entry.finished == NOON + timedelta(minutes=5)
        assert entry.state == "7 shots"


def test_search_by_name_barcode_and_date(tmp_path: Path) -> None:
    write_session(tmp_path, "a", sample="Eiche GRÜN, geölt", barcode="123")
    write_session(tmp_path, "b", sample="oak", started=(NOON - timedelta(days=3)).isoformat())
    write_session(tmp_path, "c", sample="100%_silk", started=(NOON - timedelta(days=9)).isoformat())
    with Catalogue(tmp_path) as catalogue:
        assert names(catalogue) == ["a", "b", "c"]
        assert names(catalogue, "geölt grün") == ["a"]
        assert names(catalogue, "grün oak") == []
        assert names(catalogue, "%_") == ["c"]
        assert names(catalogue, "'; DROP TABLE sessions; --") == []
        assert names(catalogue, barcode="123") == ["a"]
        assert names(catalogue, barcode="12") == []
        assert names(catalogue, "12") == ["a"]
        assert names(catalogue, since=date(2026, 11, 19)) == ["a", "b"]
        assert names(catalogue, until=date(2026, 11, 19)) == ["b", "c"]
        assert names(catalogue, since=date(2026, 11, 14), until=date(2026, 11, 21)) == ["b"]


def test_folders_come_go_and_break(tmp_path: Path) -> None:
    write_session(tmp_path, "a")
    (tmp_path / "no session").mkdir()
    (tmp_path / "notes.txt").write_text("not one either")
    with Catalogue(tmp_path) as catalogue:
        assert names(catalogue) == ["a"]
        write_session(tmp_path, "b")
        assert names(catalogue) == ["a", "b"]
        shutil.rmtree(tmp_path / "a")
        (tmp_path / "b/session.json").write_text('{"sample": "b", "sta')
        (entry,) = catalogue.search("b")
        assert entry.problem == entry.state == "damaged session.json"


def no_database(index: Path) -> None:
    index.write_bytes(b"not a database at all, but long enough to look at" * 40)


def torn(index: Path) -> None:
    index.write_bytes(index.read_bytes()[:5000])


def older(index: Path) -> None:
    connection = sqlite3.connect(index)
    connection.executescript("DROP TABLE sessions; PRAGMA user_version = 99")
    connection.close()


def gone(index: Path) -> None:
    index.unlink()


@pytest.mark.parametrize("damage", [no_database, torn, older, gone])
def test_the_index_is_made_again(tmp_path: Path, damage: Callable[[Path], None]) -> None:
    for number in range(50):
        write_session(tmp_path, f"s{number:02}", barcode=str(number))
    with Catalogue(tmp_path) as catalogue:
        before = catalogue.search()
    damage(tmp_path / INDEX)
    with Catalogue(tmp_path) as catalogue:
        assert catalogue.search() == before
        catalogue.rebuild()
        assert catalogue.search() == before


def test_two_at_once(tmp_path: Path) -> None:
    write_session(tmp_path, "a")
    with Catalogue(tmp_path) as one, Catalogue(tmp_path) as other:
        assert (tmp_path / f"{INDEX}-wal").exists()
        assert names(one) == names(other) == ["a"]
        write_session(tmp_path, "b")
        assert names(one) == names(other) == ["a", "b"]


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    write_session(tmp_path, "a")
    (tmp_path / INDEX).mkdir()  # no database can be made here, even by root
    with Catalogue(tmp_path) as catalogue:
        assert names(catalogue) == ["a"]


def test_no_folder(tmp_path: Path) -> None:
    with pytest.raises(SessionError, match="There is no folder"):
        Catalogue(tmp_path / "none")


SEARCHES: dict[str, tuple[int, dict[str, Any]]] = {
    "list": (2000, {}),
    "words": (1, {"text": "1234 OAK"}),
    "barcode": (1, {"barcode": "77"}),
    "day": (24, {"since": date(2026, 11, 19), "until": date(2026, 11, 19)}),
}


@pytest.fixture(scope="module")
def two_thousand(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of sessions that is indexed already."""
    root = tmp_path_factory.mktemp("sessions")
    for number in range(2000):
        write_session(
            root, f"s{number:04}", sample=f"sample {number} of oak", barcode=str(number),
            started=(NOON - timedelta(hours=number)).isoformat(),
        )  # fmt: skip
    with Catalogue(root) as catalogue:
        assert len(catalogue.search()) == 2000
    return root


@pytest.mark.parametrize("search", SEARCHES)
def test_two_thousand_sessions_are_listed_and_searched_in_a_tenth_of_a_second(
    two_thousand: Path, search: str
) -> None:
    expected, arguments = SEARCHES[search]
    with Catalogue(two_thousand) as catalogue:
        assert len(catalogue.search(**arguments)) == expected
        _, works = times_s(lambda: catalogue.search(**arguments))
    assert min(works) < 0.1


@pytest.mark.bench
def test_how_long_two_thousand_sessions_take(two_thousand: Path) -> None:
    print("\n2,000 sessions, median of 30 by the clock on the wall, of which this process worked:")
    with Catalogue(two_thousand) as catalogue:
        for name, (_, arguments) in SEARCHES.items():
            walls, works = times_s(lambda keys=arguments: catalogue.search(**keys))
            wall_s, work_s = statistics.median(walls), statistics.median(works)
            print(f"  {name:<9}{wall_s * 1000:6.1f} ms  {work_s * 1000:6.1f} ms")


def times_s(work: Callable[[], object]) -> tuple[list[float], list[float]]:
    """By the wall's clock, and of this process alone: the machine may be busy with something else."""
    walls, works = [], []
    for _ in range(30):
        wall, own = time.perf_counter(), time.process_time()
        work()
        walls.append(time.perf_counter() - wall)
        works.append(time.process_time() - own)
    return walls, works
