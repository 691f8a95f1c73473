"""A serial terminal to a simulated board: lines that go and lines that come, nothing hidden."""

import os
import select
from typing import Self

from turnlight.rig import line
from turnlight.simulation.board import SimulatedBoard

_PATIENCE_S = 30.0


class Terminal:
    """Says lines to a board and hears its answers; events are kept apart."""

    def __init__(self, board: SimulatedBoard) -> None:
        self.board = board
        self.events: list[str] = []
        self._port = os.open(board.port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self._pending = b""
        self._sequence = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._port)

    def say(self, text: str) -> str:
        """The first line, seal and all, that answers these characters and a newline."""
        self.send(text.encode() + b"\n")
        return self.hear()

    def hear(self) -> str:
        """The next line that is not an event."""
        while (answer := self._line()).startswith("!"):
            self._keep(answer)
        return answer

    def ask(self, command: str) -> str:
        """The answer to a sealed command, without its sequence number and seal."""
        self._sequence += 1
        answer = line.unseal(self.say(seal(f"{self._sequence} {command}")).encode())
        assert answer is not None
        number, outcome = answer.split(" ", 1)
        assert number == str(self._sequence), answer
        return outcome

    def count_from(self, sequence: int) -> None:
        """Number the next commands from here, as long as a host's numbers are."""
        self._sequence = sequence

    def fields(self, command: str) -> dict[str, str]:
        """The fields of the answer to a command that is done."""
        outcome, *fields = self.ask(command).split(" ")
        assert outcome == "ok", f"{command}: {fields}"
        return dict(field.split("=", 1) for field in fields)

    def state(self) -> str:
        return self.fields("stat")["is"]

    def settle(self) -> str:
        """Wait, with the lease kept, until the table rests; returns the state."""
        while (state := self.state()) in ("moving", "homing"):
            self.board.advance(20)
        return state

    def send(self, data: bytes) -> None:
        os.write(self._port, data)

    def take_events(self) -> list[str]:
        """Bodies of the events since last asked."""
        self.say("stat")  # comes after every event that has been sent
        events, self.events = self.events, []
        return events

    def _line(self) -> str:
        while b"\n" not in self._pending:
            ready, _, _ = select.select([self._port], [], [], _PATIENCE_S)
            assert ready, "the board does not answer"
            self._pending += os.read(self._port, 4096)
        text, self._pending = self._pending.split(b"\n", 1)
        return text.decode()

    def _keep(self, text: str) -> None:
        body = line.unseal(text.encode())
        assert body is not None
        self.events.append(body)


def seal(body: str) -> str:
    return line.seal(body).decode().removesuffix("\n")
