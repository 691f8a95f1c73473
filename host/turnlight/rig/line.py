"""Lines of the wire protocol (firmware/PROTOCOL.md): `<body> *<length><crc>`."""

import binascii
import re
from dataclasses import dataclass

_SEALED = re.compile(rb"(.+) \*([0-9A-F]{2})([0-9A-F]{4})")


@dataclass(frozen=True)
class Reply:
    """The answer to one command. error: the word for why it was refused, or None.

    sequence 0 answers a line that the controller could not read.
    """

    sequence: int
    error: str | None
    fields: dict[str, str]


@dataclass(frozen=True)
class Event:
    """What the controller says unasked, until its id is acknowledged: boot, button or fault."""

    id: int
    kind: str
    fields: dict[str, str]


def seal(body: str) -> bytes:
    """The body with its length, its CRC-16/CCITT-FALSE and a newline."""
    data = body.encode("ascii")
    return data + b" *%02X%04X\n" % (len(data), binascii.crc_hqx(data, 0xFFFF))


def unseal(line: bytes) -> str | None:
    """The body of a sealed line without its newline; None if it is damaged."""
    match = _SEALED.fullmatch(line)
    if match is None:
        return None
    body, length, crc = match.groups()
    if len(body) != int(length, 16) or binascii.crc_hqx(body, 0xFFFF) != int(crc, 16):
        return None
    return body.decode("ascii", errors="replace")


def read(line: bytes) -> Reply | Event | None:
    """What a line from the controller says; None if it is damaged."""
    words = (unseal(line) or "").split(" ")
    try:
        return _read_event(words) if words[0].startswith("!") else _read_reply(words)
    except (ValueError, IndexError):
        return None


def _read_event(words: list[str]) -> Event:
    return Event(int(words[0][1:]), words[1], _fields(words[2:]))


def _read_reply(words: list[str]) -> Reply:
    sequence, outcome = int(words[0]), words[1]
    if outcome == "ok":
        return Reply(sequence, None, _fields(words[2:]))
    if outcome == "err":
        return Reply(sequence, words[2], {})
    raise ValueError(outcome)


def _fields(words: list[str]) -> dict[str, str]:
    return dict(word.split("=", 1) for word in words)
