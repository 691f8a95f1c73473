"""What a service tells systemd: that it is ready, that it is alive, and what it is doing."""

import contextlib
import os
import socket

READY = "READY=1"
ALIVE = "WATCHDOG=1"
_UNWATCHED_US = "60000000"


def watchdog_s() -> float:
    """How long systemd waits for the next ALIVE before it starts the service anew; 60 s without one."""
    return int(os.environ.get("WATCHDOG_USEC", _UNWATCHED_US)) / 1e6


def notify(*states: str) -> None:
    """Send states such as READY, ALIVE or "STATUS=..." as sd_notify(3) does; nothing without systemd.

    Never waits and never fails: a systemd that does not listen is no reason to stop a capture.
    """
    address = os.environ.get("NOTIFY_SOCKET")
    if not address:
        return
    if address.startswith("@"):
        address = "\0" + address[1:]
    with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as line:
        line.setblocking(False)
        line.sendto("\n".join(states).encode(), address)
