"""Photos from several hands at once, from a folder, and over the end of the program: nothing is lost.

What is made of a photo is not the point here, and left out.
"""

import shutil
import threading
import time
from collections.abc import Iterable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from starlette.requests import ClientDisconnect

from turnlight.errors import ImageError, RunError, SessionError
from turnlight.handheld.inbox import MOST_REFUSALS, MOST_WAITING, Arrival, Inbox, Turn
from turnlight.handheld.verdict import Verdict
from turnlight.handheld.watch import Watch


class Pile:
    """In place of a `Handheld`: keeps what it is given, and finds out if two hands give at once."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.manifest = SimpleNamespace(sample="pile")
        self.contents: list[bytes] = []
        self.verdicts: tuple[Verdict, ...] = ()
        self.gate = threading.Event()
        self.gate.set()
        self._busy = threading.Lock()

    def add(self, paths: Iterable[Path]) -> tuple[Verdict, ...]:
        assert self._busy.acquire(blocking=False), "one at a time"
        try:
            self.gate.wait()
            (path,) = paths
            content = path.read_bytes()
            if content == b"no photo":
                raise ImageError(f"{path.name} is no photo.")
            if content == b"disk full":
                raise SessionError("The disk is full.")
            if content == b"defect":
                raise ZeroDivisionError
            time.sleep(0.001)
            self.contents.append(content)
            verdict = Verdict(len(self.contents), path.name, True)
            self.verdicts += (verdict,)
            return (verdict,)
        finally:
            self._busy.release()

    def force(self, number: int) -> tuple[Verdict, ...]:
        assert self._busy.acquire(blocking=False), "one at a time"
        self._busy.release()
        return (self.verdicts[number - 1],)


def inbox_of(pile: Any, told: list[Verdict | Arrival] | None = None) -> Inbox:
    return Inbox(pile, (told if told is not None else []).append)


def put(inbox: Inbox, name: str, content: bytes) -> None:
    with inbox.receive(name) as file:
        file.write(content)


@pytest.fixture
def pile(tmp_path: Path) -> Pile:
    return Pile(tmp_path / "session")


def test_five_hands_at_once(pile: Pile) -> None:
    told: list[Verdict | Arrival] = []
    with inbox_of(pile, told) as inbox:

        def send(hand: int) -> None:
            for number in range(10):
                put(inbox, "image.jpg", f"{hand}/{number}".encode())
                if number:
                    inbox.force(1)

        hands = [threading.Thread(target=send, args=(hand,)) for hand in range(5)]
        for hand in hands:
            hand.start()
        for hand in hands:
            hand.join()
    expected = {f"{hand}/{number}".encode() for hand in range(5) for number in range(10)}
    assert set(pile.contents) == expected and len(pile.contents) == 50
    for hand in range(5):
        own = [c for c in pile.contents if c.startswith(f"{hand}/".encode())]
        assert own == sorted(own), "in the order in which they came"
    assert len(told) == 50 + 45 and not (pile.folder / "incoming").exists()
    assert inbox.news.arrivals == () and len(inbox.news.verdicts) == 50


def test_what_waits_can_be_seen_and_a_program_that_ends_does_it_first(pile: Pile) -> None:
    pile.gate.clear()
    with inbox_of(pile) as inbox:
        for name in ("a.jpg", "b.jpg"):
            put(inbox, name, name.encode())
        assert [a.name for a in inbox.news.arrivals] == ["a.jpg", "b.jpg"]
        assert inbox.news.arrivals[1].turn is Turn.WAITING
        pile.gate.set()
    assert pile.contents == [b"a.jpg", b"b.jpg"]


def test_what_a_killed_program_left_is_taken_up(pile: Pile) -> None:
    for number in (1, 2):
        left = pile.folder / f"incoming/{number:04d}/IMG {number}.jpg"
        left.parent.mkdir(parents=True)
        left.write_bytes(f"left {number}".encode())
    half = pile.folder / "incoming/0003/.partial"
    half.parent.mkdir()
    half.write_bytes(b"half a pho")
    with inbox_of(pile) as inbox:
        inbox.wait()
    assert sorted(pile.contents) == [b"left 1", b"left 2"]
    assert [v.name for v in pile.verdicts] == ["IMG 1.jpg", "IMG 2.jpg"]
    assert not (pile.folder / "incoming").exists()


def test_refusals_are_told_shown_and_forgotten(pile: Pile) -> None:
    told: list[Verdict | Arrival] = []
    with inbox_of(pile, told) as inbox:
        put(inbox, "cat.gif", b"no photo")
        inbox.wait()
        (refused,) = inbox.news.arrivals
        assert (refused.turn, refused.sentence) == (Turn.REFUSED, "cat.gif is no photo.")
        assert told == [refused]
        inbox.dismiss(99)
        inbox.dismiss(refused.number)
        assert inbox.news.arrivals == ()
        for _ in range(MOST_REFUSALS + 5):
            put(inbox, "cat.gif", b"no photo")
        inbox.wait()
        assert len(inbox.news.arrivals) == MOST_REFUSALS


@pytest.mark.parametrize(
    ("content", "why"), [(b"disk full", "disk is full"), (b"defect", "failed at a.jpg")]
)
def test_a_photo_that_is_not_to_blame_stays(
    pile: Pile, content: bytes, why: str, caplog: pytest.LogCaptureFixture
) -> None:
    with inbox_of(pile) as inbox:
        put(inbox, "a.jpg", content)
        inbox.wait()
        assert why in str(inbox.news.arrivals[0].sentence)
    (stays,) = (pile.folder / "incoming").glob("*/*")
    assert stays.read_bytes() == content
    stays.write_bytes(b"better now")
    with inbox_of(pile):
        pass
    assert pile.contents == [b"better now"]


def test_half_an_upload_leaves_nothing(pile: Pile) -> None:
    with inbox_of(pile) as inbox:
        with pytest.raises(ClientDisconnect), inbox.receive("a.jpg") as file:
            file.write(b"half a pho")
            raise ClientDisconnect
        assert inbox.news.arrivals == ()
        assert not list((pile.folder / "incoming").iterdir())
    assert pile.contents == []


def test_too_many_have_to_come_again(pile: Pile) -> None:
    pile.gate.clear()
    with inbox_of(pile) as inbox:
        for number in range(MOST_WAITING):
            put(inbox, "a.jpg", str(number).encode())
        with pytest.raises(RunError, match="60 photos wait already; send this one again"):
            put(inbox, "a.jpg", b"one more")
        pile.gate.set()
        inbox.wait()
        put(inbox, "a.jpg", b"one more")
    assert len(pile.contents) == MOST_WAITING + 1


@pytest.mark.parametrize(
    ("sent", "kept"),
    [
        ("../../etc/passwd", "passwd"),
        ("..\\..\\boot.ini", "boot.ini"),
        (".partial", "partial"),
        ("", "photo"),
        ("/", "photo"),
        ("a\0b\n<i>.jpg", "a_b_i_.jpg"),
        ("Photo (1) – Küche.HEIC", "Photo (1) _ Küche.HEIC"),
        ("x" * 500 + ".jpeg", "x" * 70 + ".jpeg"),
    ],
)
def test_names_are_plain(pile: Pile, sent: str, kept: str) -> None:
    with inbox_of(pile) as inbox:
        put(inbox, sent, b"photo")
    assert [v.name for v in pile.verdicts] == [kept]


def test_a_folder_is_watched(tmp_path: Path) -> None:
    folder = tmp_path / "from the phone"
    folder.mkdir()
    (folder / "before.jpg").write_bytes(b"there already")
    taken: list[tuple[str, bytes]] = []

    def take(path: Path) -> None:
        taken.append((path.name, path.read_bytes()))

    def until(count: int) -> None:
        until_s = time.monotonic() + 60
        while len(taken) < count and time.monotonic() < until_s:
            time.sleep(0.02)
        assert len(taken) == count, taken

    with Watch(folder, take):
        until(1)
        for name in ("notes.txt", ".hidden.jpg", "a.jpg.part", "empty.png"):
            (folder / name).write_bytes(b"" if name == "empty.png" else b"x")
        (folder / "folder.jpg").mkdir()
        (folder / "IMG_1.HEIC").write_bytes(b"one")
        until(2)
        (tmp_path / "moved").write_bytes(b"two")
        shutil.move(tmp_path / "moved", folder / "IMG_2.dng")
        until(3)
        (folder / "IMG_1.HEIC").write_bytes(b"another of the same name")
        until(4)
    assert taken[0] == ("before.jpg", b"there already")
    assert [name for name, _ in taken[1:]] == ["IMG_1.HEIC", "IMG_2.dng", "IMG_1.HEIC"]
    assert taken[3][1] == b"another of the same name"


def test_a_photo_that_grew_is_taken_whole(tmp_path: Path) -> None:
    taken: list[int] = []
    with Watch(tmp_path, lambda path: taken.append(path.stat().st_size)):
        with (tmp_path / "slow.jpg").open("wb") as file:
            for _ in range(60):
                file.write(bytes(1000))
                file.flush()
                time.sleep(0.02)
        until_s = time.monotonic() + 60
        while taken[-1:] != [60_000] and time.monotonic() < until_s:
            time.sleep(0.02)
    assert taken[-1] == 60_000


def test_a_folder_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(
        SessionError, match=r"Cannot watch .*nowhere: no such file or directory; name"
    ):
        Watch(tmp_path / "nowhere", print)
