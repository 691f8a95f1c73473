"""What is put on the table to calibrate, and what is known of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from turnlight.calibration import StepName


class Target(StrEnum):
    """One thing to be put on the platter; `rig_config/targets` has the printable ones."""

    NOTHING = "nothing"
    BOARD = "board"
    BALL = "ball"
    WHITE = "white"
    CHART = "chart"


TARGET_OF: Mapping[StepName, Target] = {
    "dark": Target.NOTHING,
    "geometry": Target.BOARD,
    "lights": Target.BALL,
    "white": Target.WHITE,
    "colour": Target.CHART,
}
"""What each step needs on the table, in the order of the steps."""


@dataclass(frozen=True)
class Targets:
    """The targets at hand, as measured with a ruler, callipers, or by whoever made them.

    square_mm: side of the board's squares. ball_place_mm: roughly where the ball touches the platter,
    in the platter's frame. white_reflectance: diffuse, of the white board. thickness_mm: of white board
    and chart.
    """

    square_mm: float = 12.0
    ball_diameter_mm: float = 30.0
    ball_place_mm: tuple[float, float] = (0.0, 30.0)
    white_reflectance: float = 0.95
    thickness_mm: float = 2.0

    def instruction(self, target: Target) -> str:
        """One sentence for the operator."""
        x, y = self.ball_place_mm
        return {
            Target.NOTHING: "Take everything off the platter and darken the room.",
            Target.BOARD: "Lean the ChArUco board back by 20 to 30 degrees on the platter's middle, "
            "so that it rides with the table and hides few markers.",
            Target.BALL: f"Put the glossy ball of {self.ball_diameter_mm:g} mm on the platter at "
            f"x = {x:g}, y = {y:g} mm, where it cannot roll.",
            Target.WHITE: "Lay the matte white board where a sample lies.",
            Target.CHART: "Lay the 24-patch colour chart where a sample lies.",
        }[target]
