"""What is installed is what systemd and udev understand, and systemd is told that the program lives."""

import getpass
import json
import re
import shutil
import socket
import subprocess
from pathlib import Path

import pytest
from typer.testing import CliRunner

from turnlight import cli
from turnlight.errors import ServiceError, TurnlightError
from turnlight.notify import ALIVE, READY, notify
from turnlight.rig.usb import BOARDS
from turnlight.service import RULES, UNIT, Service, install, udev_rules

RIG = Path(__file__).parents[2] / "rig_config/oak.toml"


@pytest.fixture
def service(tmp_path: Path) -> Service:
    return Service(RIG, tmp_path / "sessions", getpass.getuser())


@pytest.mark.parametrize("abstract", [False, True])
def test_systemd_hears_from_us(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, abstract: bool
) -> None:
    address = f"@turnlight-{tmp_path.name}" if abstract else str(tmp_path / "notify")
    monkeypatch.setenv("NOTIFY_SOCKET", address)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
        systemd.bind(address.replace("@", "\0"))
        systemd.settimeout(5)
        notify(READY, "STATUS=ready")
        notify(ALIVE)
        assert systemd.recv(100) == b"READY=1\nSTATUS=ready"
        assert systemd.recv(100) == b"WATCHDOG=1"


def test_without_a_systemd_that_listens_nothing_happens(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    notify(READY)
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "none"))
    notify(READY)
    monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "deaf"))
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as deaf:
        deaf.bind(str(tmp_path / "deaf"))
        for _ in range(2000):
            notify(ALIVE)


def test_the_unit_is_one_that_systemd_takes(service: Service, tmp_path: Path) -> None:
    install(service, tmp_path)
    text = (tmp_path / UNIT).read_text()
    assert "Type=notify" in text
    assert re.search(r"^WatchdogSec=\d+$", text, re.MULTILINE)
    assert f"serve --rig {RIG} --out {tmp_path}/sessions" in text
    if shutil.which("systemd-analyze") is None:  # a container, or a system with another init
        pytest.skip("systemd is not installed here; the tests beside this look at the unit's parts")
    verified = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", tmp_path / UNIT],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert not [line for line in verified.stderr.splitlines() if "turnlight.service" in line]


def test_the_unit_starts_a_command_that_there_is(service: Service) -> None:
    (line,) = re.findall(r"^ExecStart=(.*)$", service.unit(), re.MULTILINE)
    program, *arguments = line.split()
    assert Path(program).exists()
    options = [word for word in arguments if word.startswith("--")]
    known = CliRunner().invoke(cli.commands, [arguments[0], "--help"])
    assert known.exit_code == 0
    assert all(option in known.stdout for option in options)


def test_the_rules_name_every_board_and_the_camera() -> None:
    rules = [line for line in udev_rules().splitlines() if not line.startswith("#")]
    assert len(rules) == len(BOARDS) + 1
    part = r'(?:[A-Z]+\{\w+\}|[A-Z]+)(?:==|=|\+=)"[\w.*-]+"'
    assert all(re.fullmatch(rf"{part}(, {part})*", rule) for rule in rules), rules
    assert 'ATTR{idVendor}=="03e7"' in rules[0]
    assert any('ATTRS{idProduct}=="0042"' in rule and "MM_DEVICE_IGNORE" in rule for rule in rules)


def test_the_command_writes_and_says_what(tmp_path: Path) -> None:
    rules_only = CliRunner().invoke(
        cli.commands, ["install-service", "--rules-only", "--root", str(tmp_path)]
    )
    assert rules_only.stdout == f"Wrote {tmp_path / RULES}\n"
    assert not (tmp_path / UNIT).exists()
    both = ["install-service", "--rig", str(RIG), "--root", str(tmp_path), "--json"]
    answer = CliRunner().invoke(cli.commands, both)
    assert json.loads(answer.stdout)["written"] == [str(tmp_path / RULES), str(tmp_path / UNIT)]
    assert "--out /var/lib/turnlight" in (tmp_path / UNIT).read_text()


def test_what_could_not_run_is_not_installed(tmp_path: Path) -> None:
    user = getpass.getuser()
    for bad, because in (
        (Service(RIG, tmp_path, "nobody-of-that-name"), "no user nobody-of-that-name"),
        (Service(RIG, tmp_path / "my sessions", user), "blank"),
        (Service(tmp_path / "none.toml", tmp_path, user), "Cannot read the rig file"),
    ):
        with pytest.raises(TurnlightError, match=because):
            install(bad, tmp_path / "root")
    assert not (tmp_path / "root").exists()
    (tmp_path / "root").write_text("a file, not a folder")
    with pytest.raises(ServiceError, match="run it with sudo"):
        install(None, tmp_path / "root")
