from turnlight.app import DEFAULT_RIG, connect
from turnlight.config import RigConfig
from turnlight.rig.controller import Controller
from turnlight.rig.link import SerialLink
from turnlight.simulation.board import BoardClock, SimulatedBoard


def test_a_rig_left_with_a_fault_by_a_host_that_died_is_ready_again():
    config = RigConfig.load(DEFAULT_RIG)
    with SimulatedBoard() as board:
        link = SerialLink(board.port, config.controller.baud)
        died = Controller(link, BoardClock(board))
        died.hello()
        died.light([3])
        board.advance(1500)
        assert died.status().state == "lease"
        link.close()
        controller = config.controller.model_copy(update={"port": board.port})
        with connect(config.model_copy(update={"controller": controller})) as connection:
            assert connection.controller.status().state == "unhomed"
