"""The vectors that the firmware's tests read too."""

from pathlib import Path

import pytest

from turnlight.rig import line
from turnlight.rig.line import Event, Reply

_FILE = Path(__file__).parents[3] / "firmware" / "protocol_vectors.txt"


def _vectors(*kinds: str) -> list[list[str]]:
    rows = [row.split("|") for row in _FILE.read_text().splitlines() if row and row[0] != "#"]
    return [row for row in rows if row[0] in kinds]


@pytest.mark.parametrize(("_", "body", "sealed"), _vectors("line"))
def test_sealing_and_unsealing_agree_with_the_vectors(_: str, body: str, sealed: str) -> None:
    assert line.seal(body) == sealed.encode() + b"\n"
    assert line.unseal(sealed.encode()) == body


@pytest.mark.parametrize(("_", "crc", "text"), _vectors("crc"))
def test_crc_agrees_with_the_vectors(_: str, crc: str, text: str) -> None:
    assert line.seal(text)[-5:-1] == crc.encode()


@pytest.mark.parametrize(("_", "damaged"), _vectors("damaged"))
def test_damaged_lines_are_not_read(_: str, damaged: str) -> None:
    assert line.unseal(damaged.encode()) is None
    assert line.read(damaged.encode()) is None


@pytest.mark.parametrize(("_", "sent", "answer"), _vectors("exchange", "then"))
def test_replies_in_the_vectors_can_be_read(_: str, sent: str, answer: str) -> None:
    reply = line.read(answer.encode())
    assert isinstance(reply, Reply)
    assert (reply.error is None) == (" ok" in answer)


def test_fields_and_events_are_read() -> None:
    assert line.read(line.seal("8 ok shot=4 lit=01")[:-1]) == Reply(
        8, None, {"shot": "4", "lit": "01"}
    )
    assert line.read(line.seal("0 err check")[:-1]) == Reply(0, "check", {})
    assert line.read(line.seal("!3 fault fault=estop")[:-1]) == Event(
        3, "fault", {"fault": "estop"}
    )


@pytest.mark.parametrize("body", ["8", "x ok", "8 maybe", "8 err", "8 ok shot", "! boot", "!1"])
def test_a_sealed_line_that_means_nothing_is_damaged(body: str) -> None:
    assert line.read(line.seal(body)[:-1]) is None
