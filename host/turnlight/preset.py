"""A preset: how a sample is captured, under a name that a technician picks."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field


class Preset(BaseModel):
    """One section [preset.NAME] of a rig file. Every key may be left out."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    title: str = ""
    """What the technician reads beside the name."""
    shots: Annotated[int, Field(ge=1, le=10_000)] = 10
    """How many pictures at most."""
    order: Literal["fixed", "adaptive"] = "fixed"
    """"adaptive": after the first three, the shot that is expected to tell most comes next, arcs of LEDs
    included where the sample is shiny; "fixed": the rig's plan."""
    exposure: Literal["test", "fixed"] = "test"
    """"test": before the first shot, an exposure for each LED is found on the sample; "fixed": the
    rig file's own exposure for all."""
    bracketing: bool = False
    """A second, shorter exposure of every shot, for shiny samples."""
    enough_change: Annotated[float, Field(ge=0, lt=1)] = 0.005
    """Two pictures in a row that change the maps by less than this are enough; at 0 none ever are."""
    stop_when_enough: bool = False
    """End the capture when it is enough, instead of only saying so."""
