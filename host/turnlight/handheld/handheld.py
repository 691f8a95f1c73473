"""A sample photographed by hand: photo after photo in, a verdict on each and better maps out.

The command line and the phone's page both drive this, and nothing else.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Self

from svbrdf.maps import Maps
from turnlight.handheld.verdict import Verdict


class Handheld:
    """One sample's session folder. Not for several threads at once: the caller holds a lock."""

    def __init__(self, folder: Path, sample: str) -> None:
        """Make the folder, which must not exist or be empty. Raises SessionError or ModelError."""
        raise NotImplementedError

    @classmethod
    def open(cls, folder: Path) -> Self:
        """A folder that was made before, to go on with it. Raises SessionError or ModelError."""
        raise NotImplementedError

    @property
    def maps(self) -> Maps | None:
        """Of the photos used so far; they are also on disk, in maps/, after each photo."""
        raise NotImplementedError

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        """On every photo so far, in their order. A later photo can change an earlier one's."""
        raise NotImplementedError

    def add(self, paths: Sequence[Path]) -> tuple[Verdict, ...]:
        """Keep photos (copied into photos/), check them, and make the maps anew; a verdict on each.

        Path.name is what the photo is called. Raises PhotoError for a file that is no photo; then none of
        them is kept.
        """
        raise NotImplementedError

    def force(self, number: int) -> Verdict:
        """Use a photo in spite of what the checks found. Raises RunError where that cannot be done."""
        raise NotImplementedError

    def leave_out(self, number: int) -> Verdict:
        """Use a photo no more; it stays in the folder."""
        raise NotImplementedError
