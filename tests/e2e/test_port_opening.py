"""A board that restarts when its port is opened: the run finds out, homes, and its maps are right."""

from pathlib import Path

import pytest

from turnlight import app
from turnlight.capture.session import Session
from turnlight.config import ControllerConfig, RigConfig
from turnlight.preset import Preset
from turnlight.rig.link import SerialLink
from turnlight.simulation.board import SimulatedBoard, simulated_board

STOOD_AT_DEG = 77.0


def test_a_board_reset_by_the_opening_of_its_port_is_homed(
    small_rig: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    boards: list[SimulatedBoard] = []

    def board_of(controller: ControllerConfig) -> SimulatedBoard:
        board = simulated_board(controller)
        assert board is not None
        board.slip(STOOD_AT_DEG)  # where the last run left the table
        boards.append(board)
        return board

    class ResettingLink(SerialLink):
        def __init__(self, port: str, baud: int) -> None:
            super().__init__(port, baud)
            boards[-1].reset()

    monkeypatch.setattr(app, "simulated_board", board_of)
    monkeypatch.setattr(app, "SerialLink", ResettingLink)
    config = RigConfig.load(small_rig)
    with app.connect(config) as connection:
        assert not connection.controller.status().homed
    list(
        app.capture(
            config, app.Sample("oak", 2.0), Preset(shots=1, exposure="fixed"), tmp_path / "s"
        )
    )
    (record,) = Session.open(tmp_path / "s").manifest.used
    off_deg = record.measured_angle_deg - record.shot.angle_deg
    assert abs((off_deg + 180) % 360 - 180) < 0.1
    assert record.warning is None
