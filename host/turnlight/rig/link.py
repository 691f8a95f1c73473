"""The serial line to the controller: one command in flight, sent again until it is answered.

Waiting for an answer takes real time, even when the rig behind the line lives in virtual time.
"""

import contextlib
import errno
import queue
import secrets
import termios
import threading
import time

import serial

from turnlight.errors import LinkError, RigError
from turnlight.rig import line
from turnlight.rig.line import Event, Reply

STOP_BYTE = b"\x18"
_WRITE_LIMIT_S = 3.0


class RefusedError(RigError):
    """The controller understood a command and did not do it; `word` is its reason."""

    def __init__(self, verb: str, word: str) -> None:
        super().__init__(
            f"The controller refused `{verb}` ({word}); firmware/PROTOCOL.md lists the reasons."
        )
        self.word = word


class SerialLink:
    """An open serial port and the thread that reads it.

    A command that gets no answer, or a damaged one, is sent again under its sequence number; the
    controller answers it again and does it once.
    """

    def __init__(
        self, port: str, baud: int, *, retry_after_s: float = 0.25, give_up_after_s: float = 3.0
    ) -> None:
        """Open `port`. Raises LinkError if it is not there, not permitted or in use."""
        self._port = port
        self._retry_after_s = retry_after_s
        self._give_up_after_s = give_up_after_s
        self._serial = _open(port, baud)
        self._lock = threading.Lock()
        self._port_lock = threading.Lock()
        self._sequence = 10000 + secrets.randbelow(50000)
        self._replies: queue.SimpleQueue[Reply | LinkError | None] = queue.SimpleQueue()
        self._arrived: queue.SimpleQueue[Event] = queue.SimpleQueue()
        self._events: list[Event] = []
        self._latest: dict[str, Event] = {}
        self._closing = False
        self._reader = threading.Thread(target=self._read, name=f"reader of {port}", daemon=True)
        self._reader.start()

    def request(self, verb: str, *arguments: int | str) -> dict[str, str]:
        """Have a command done exactly once and return the fields of its reply.

        Raises RefusedError if the controller will not do it, LinkError if it does not answer.
        """
        with self._lock:
            self._acknowledge_events()
            return self._exchange(verb, *arguments)

    def stop_now(self) -> None:
        """Send the byte that stops everything, ahead of any command in flight.

        Raises LinkError if the port has gone or is closed.
        """
        self._write(STOP_BYTE)

    def take_events(self) -> list[Event]:
        """The events that have come since last asked, each once."""
        with self._lock:
            self._acknowledge_events()
            events, self._events = self._events, []
            return events

    def close(self) -> None:
        """Close the port and end the reader; may be called twice."""
        self._closing = True
        self._serial.cancel_read()
        self._reader.join()
        with self._port_lock:  # closed under a write, the port would be any file opened since
            self._serial.close()

    def _exchange(self, verb: str, *arguments: int | str) -> dict[str, str]:
        self._sequence = self._sequence % 65535 + 1
        command = line.seal(" ".join(map(str, (self._sequence, verb, *arguments))))
        give_up_s = time.monotonic() + self._give_up_after_s
        self._write(command)
        while (reply := self._await_reply()) is None:
            if time.monotonic() > give_up_s:
                raise LinkError(
                    f"The controller on {self._port} does not answer; check its power and cable, "
                    "and that the port and baud rate in the rig's file are its own."
                )
            self._write(b"\n" + command)  # the newline ends what is left of a damaged line
        if reply.error is not None:
            raise RefusedError(verb, reply.error)
        return reply.fields

    def _await_reply(self) -> Reply | None:
        """The reply to the command in flight; None when it is time to send it again."""
        deadline_s = time.monotonic() + self._retry_after_s
        while True:
            try:
                reply = self._replies.get(timeout=max(0.0, deadline_s - time.monotonic()))
            except queue.Empty:
                return None
            if isinstance(reply, LinkError):
                self._replies.put(reply)
                raise reply
            if reply is None or reply.sequence == 0:
                return None
            if reply.sequence == self._sequence:
                return reply

    def _acknowledge_events(self) -> None:
        while not self._arrived.empty():
            event = self._arrived.get()
            if self._latest.get(event.kind) != event:
                if event.kind == "boot":
                    self._latest.clear()
                self._latest[event.kind] = event
                self._events.append(event)
            with contextlib.suppress(RefusedError):  # in a fault: the event will come again
                self._exchange("ack", event.id)

    def _write(self, data: bytes) -> None:
        try:
            with self._port_lock:
                self._serial.write(data)
        except (serial.SerialException, OSError) as error:
            raise self._gone() from error

    def _read(self) -> None:
        pending = b""
        while not self._closing:
            try:
                pending += self._serial.read(max(1, self._serial.in_waiting))
            except (serial.SerialException, OSError, TypeError):
                self._replies.put(self._gone())
                return
            *lines, pending = pending.split(b"\n")
            for text in lines:
                self._dispatch(text)

    def _dispatch(self, text: bytes) -> None:
        message = line.read(text)
        if isinstance(message, Event):
            self._arrived.put(message)
        else:
            self._replies.put(message)

    def _gone(self) -> LinkError:
        return LinkError(
            f"The serial port {self._port} has gone; plug the controller in again and start anew."
        )


def _open(port: str, baud: int) -> serial.Serial:
    try:
        opened = serial.Serial(port, baud, exclusive=True, write_timeout=_WRITE_LIMIT_S)
    except (serial.SerialException, OSError, ValueError) as error:
        raise LinkError(_why_closed(port, getattr(error, "errno", None))) from error
    _keep_dtr_after_close(opened.fd)
    return opened


def _keep_dtr_after_close(descriptor: int) -> None:
    """Linux drops DTR on close and raises it on open, which resets many boards: clear HUPCL."""
    settings = termios.tcgetattr(descriptor)
    settings[2] &= ~termios.HUPCL
    termios.tcsetattr(descriptor, termios.TCSANOW, settings)


def _why_closed(port: str, code: int | None) -> str:
    if code == errno.ENOENT:
        return (
            f"The serial port {port} is not there; plug the controller in, "
            "or correct `port` in the rig's file."
        )
    if code == errno.EACCES:
        return (
            f"The serial port {port} may not be opened by this user; "
            "add the user to the group `dialout` and log in again."
        )
    if code in (errno.EAGAIN, errno.EBUSY):
        return f"The serial port {port} is in use; close the other program that has it open."
    return f"{port} cannot be used as a serial port; correct `port` in the rig's file."
