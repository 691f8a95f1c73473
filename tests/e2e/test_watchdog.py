"""The service as systemd sees it: it says that it is ready, then that it is alive, and ends when told."""

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path


def test_systemd_hears_that_the_service_is_ready_and_alive(small_rig: Path, tmp_path: Path) -> None:
    address = tmp_path / "notify"
    program = Path(sys.executable).with_name("turnlight")
    command = [program, "serve", "--rig", small_rig, "--out", tmp_path / "sessions", "--port", "0"]
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(str(address))
        systemd.settimeout(60)
        environment = os.environ | {"NOTIFY_SOCKET": str(address)}
        with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL) as service:
            try:
                assert systemd.recv(1000).decode().startswith("READY=1\nSTATUS=")
                assert [systemd.recv(1000) for _ in range(2)] == [b"WATCHDOG=1"] * 2
            finally:
                service.send_signal(signal.SIGTERM)
            assert service.wait(30) in (0, 128 + signal.SIGTERM)
