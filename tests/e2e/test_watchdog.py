"""The service as systemd sees it: ready when its page answers, alive while its rig is, and silent if not."""

import os
import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from turnlight.capture import engine
from turnlight.capture.events import Finished

from .conftest import rig_file

WATCHDOG_S = 6


@dataclass
class Service:
    """`turnlight serve` as systemd starts it, and the socket that systemd listens at."""

    process: subprocess.Popen[str]
    systemd: socket.socket

    def hear(self, timeout_s: float) -> str | None:
        """What the service says next."""
        self.systemd.settimeout(timeout_s)
        try:
            return self.systemd.recv(1000).decode()
        except TimeoutError:
            return None

    def boards(self) -> list[int]:
        """The processes of its simulated board."""
        tasks = Path(f"/proc/{self.process.pid}/task").glob("*/children")
        return [int(number) for task in tasks for number in task.read_text().split()]


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Service]:
    address = str(tmp_path / "notify")
    rig = rig_file(tmp_path / "rig.toml", 676, 507)
    program = Path(sys.executable).with_name("turnlight")
    command = [program, "serve", "--rig", rig, "--out", tmp_path / "sessions", "--port", "0"]
    told = {"NOTIFY_SOCKET": address, "WATCHDOG_USEC": str(WATCHDOG_S * 10**6)}
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(address)
        with subprocess.Popen(
            command, env=os.environ | told, stdout=subprocess.PIPE, text=True
        ) as process:
            yield Service(process, systemd)
            process.kill()


def test_systemd_hears_that_the_service_is_ready_and_alive_and_ends_it(service: Service) -> None:
    ready = service.hear(60)
    assert ready is not None
    assert ready.startswith("READY=1\nSTATUS=")
    page = service.process.stdout.readline().split()[-1]
    with urllib.request.urlopen(page, timeout=30) as answer:
        assert answer.status == 200
    assert [service.hear(60) for _ in range(2)] == ["WATCHDOG=1"] * 2
    service.process.send_signal(signal.SIGTERM)
    assert service.process.wait(60) in (0, 128 + signal.SIGTERM)


def test_systemd_hears_no_more_of_a_service_whose_rig_hangs(service: Service) -> None:
    while service.hear(60) != "WATCHDOG=1" or not service.boards():
        assert service.process.poll() is None
    boards = service.boards()
    for board in boards:
        os.kill(board, signal.SIGSTOP)
    try:
        for _ in range(10 * WATCHDOG_S):
            if service.hear(WATCHDOG_S) is None:
                break
        else:
            raise AssertionError("the service says that it is alive")
        assert service.process.poll() is None  # systemd would start it anew now
    finally:
        for board in boards:
            os.kill(board, signal.SIGKILL)


def test_a_run_that_hangs_is_not_alive(bench, monkeypatch: pytest.MonkeyPatch) -> None:
    capture, alive = bench.camera.capture, []

    def hang(exposure):
        alive.append(bench.engine.alive)
        with monkeypatch.context() as patched:
            patched.setattr(engine, "SILENCE_S", 0.0)
            alive.append(bench.engine.alive)
        return capture(exposure)

    assert bench.engine.alive
    bench.camera.capture = hang
    bench.start()
    bench.until(Finished)
    assert alive == [True, False] * (len(alive) // 2)
    assert bench.engine.alive
