"""turnlight firmware flash, with an avrdude that only notes how it was called."""

import json
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from typer.testing import CliRunner

from turnlight import app, cli, flash
from turnlight.config import RigConfig
from turnlight.errors import FirmwareError, LinkError
from turnlight.rig.link import SerialLink
from turnlight.simulation.board import SimulatedBoard, simulated_board


@pytest.fixture(params=["atmega2560", "atmega328p"])
def chip(request: pytest.FixtureRequest) -> str:
    chip: str = request.param
    return chip


@pytest.fixture
def board(chip: str) -> Iterator[SimulatedBoard]:
    controller = RigConfig.load(app.DEFAULT_RIG).controller
    board = simulated_board(controller.model_copy(update={"port": f"simulated:{chip}"}))
    assert board is not None
    with board:
        yield board


@pytest.fixture
def config(board: SimulatedBoard) -> RigConfig:
    return with_port(board.port)


@pytest.fixture
def avrdude(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the false avrdude notes its arguments; it fails if a file `fail` lies beside."""
    folder = tmp_path / "bin"
    folder.mkdir()
    notes = folder / "notes"
    program = folder / "avrdude"
    program.write_text(
        f'#!/bin/sh\necho "$@" >> {shlex.quote(str(notes))}\n'
        f"if [ -e {shlex.quote(str(folder / 'fail'))} ]; then\n"
        "  echo 'avrdude: stk500_recv(): programmer is not responding' >&2\n  exit 1\nfi\n"
    )
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}:{Path(sys.executable).parent}:/usr/bin:/bin")
    return notes


def with_port(port: str) -> RigConfig:
    config = RigConfig.load(app.DEFAULT_RIG)
    controller = config.controller.model_copy(update={"port": port})
    return config.model_copy(update={"controller": controller})


def test_avrdude_writes_the_boards_image_and_hello_confirms_it(
    config: RigConfig, chip: str, avrdude: Path
) -> None:
    image = flash.flash(config)
    assert image == flash.image_for(chip)
    programmer = {"atmega2560": "wiring", "atmega328p": "arduino"}[chip]
    assert avrdude.read_text() == (
        f"-p {chip} -c {programmer} -P {config.controller.port} -b 115200 -D "
        f"-U flash:w:{image.path}:i\n"
    )


def test_a_build_that_is_not_confirmed_is_an_error(
    config: RigConfig, chip: str, avrdude: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    says = {"board": chip, "firmware": "9.9.9", "build": "other"}
    (tmp_path / f"turnlight-{chip}.hex").write_text(":00000001FF\n")
    (tmp_path / f"turnlight-{chip}.json").write_text(json.dumps(says))
    monkeypatch.setattr(flash.image_for, "__defaults__", (tmp_path,))
    with pytest.raises(FirmwareError, match=r"and not the firmware 9\.9\.9, build other"):
        flash.flash(config)


def test_a_rig_at_work_is_left_alone(config: RigConfig, avrdude: Path) -> None:
    link = SerialLink(config.controller.port, config.controller.baud)
    link.request("hello")
    with pytest.raises(LinkError, match="in use"):
        flash.flash(config)
    link.request("led", 255, "1")
    link.close()
    with pytest.raises(FirmwareError, match="at work"):
        flash.flash(config)
    assert not avrdude.exists()


def test_a_failure_of_avrdude_is_told_with_its_reason(config: RigConfig, avrdude: Path) -> None:
    (avrdude.parent / "fail").touch()
    with pytest.raises(FirmwareError, match=r"programmer is not responding.*capacitor"):
        flash.flash(config)


def test_the_wrong_board_is_refused(config: RigConfig, chip: str, avrdude: Path) -> None:
    other = next(board for board in flash.BOARDS if board != chip)
    with pytest.raises(FirmwareError, match=f"is an {chip}, not an {other}"):
        flash.flash(config, other)
    assert not avrdude.exists()


def test_a_missing_avrdude_is_named(config: RigConfig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "/nowhere")
    with pytest.raises(FirmwareError, match="apt install avrdude"):
        flash.flash(config)


def test_firmware_that_is_not_built_is_named(tmp_path: Path) -> None:
    with pytest.raises(FirmwareError, match="run `make firmware`"):
        flash.image_for("atmega2560", tmp_path)
    with pytest.raises(FirmwareError, match='no firmware for a board "esp32"'):
        flash.image_for("esp32")


def test_a_simulated_rig_has_nothing_to_flash() -> None:
    result = CliRunner().invoke(cli.commands, ["firmware", "flash"])
    assert result.exit_code == 1
    assert "is simulated" in result.stderr


def test_the_command_answers_in_json(config: RigConfig, tmp_path: Path, avrdude: Path) -> None:
    rig = tmp_path / "rig.toml"
    text = app.DEFAULT_RIG.read_text().replace(
        'port = "simulated"', f'port = "{config.controller.port}"'
    )
    rig.write_text(text)
    result = CliRunner().invoke(cli.commands, ["firmware", "flash", "--rig", str(rig), "--json"])
    assert result.exit_code == 0, result.stdout
    assert json.loads(result.stdout)["board"] in flash.BOARDS
