"""What the checks say of a photo."""

from dataclasses import dataclass
from enum import StrEnum


class Problem(StrEnum):
    """Why a photo is kept and not used."""

    FRAME = "frame"
    SMALL = "small"
    OBLIQUE = "oblique"
    SIZE = "size"
    CLIPPED = "clipped"
    BLURRED = "blurred"
    SHADOW = "shadow"
    DUPLICATE = "duplicate"


@dataclass(frozen=True)
class Fault:
    """problem, and one sentence for who takes the photos: what is wrong and what to do."""

    problem: Problem
    sentence: str


@dataclass(frozen=True)
class Verdict:
    """number: from 1, the photo's in its session. name: the file's. used: whether the maps are made of it.

    faults: what the checks found, the first being what to say; a photo that was forced is used with its
    faults. can_be_forced: False where nothing can be done without the frame. warning: a sentence about what
    does not keep a photo from being used.
    """

    number: int
    name: str
    used: bool
    faults: tuple[Fault, ...] = ()
    can_be_forced: bool = True
    warning: str | None = None

    @property
    def sentence(self) -> str:
        """What to tell who took it."""
        if self.faults:
            return self.faults[0].sentence
        return f"Used. {self.warning}" if self.warning else "Used."
