"""Scores of every method on pictures of a rig whose calibration is off: `svbrdf.evaluate --rig`.

The rig itself comes from whatever package has registered one in the entry point group svbrdf.rigs: a
function (material, resolution, counts, seed, methods) -> iterator of (method, count, maps).
"""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import entry_points
from pathlib import Path

from svbrdf import materials
from svbrdf.maps import Maps
from svbrdf.scores import Scores, renderings, score

METHODS = ("no model", "network without poses", "network with poses", "classical", "refinement")
COUNTS = (1, 2, 3, 5, 10, 20)
Rig = Callable[[Maps, int, Sequence[int], int, Sequence[str]], Iterator[tuple[str, int, Maps]]]
Rows = dict[str, dict[int, Scores]]
"""By method and number of shots."""


@dataclass(frozen=True)
class Draw:
    """A material, and the seed of the calibration's errors under which it is captured."""

    material: str
    seed: int
    resolution: int


class Log:
    """Scores in a file of JSON lines, so that a run which was cut off goes on; None keeps nothing."""

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._rows: dict[Draw, Rows] = {}
        lines = path.read_text().splitlines() if path and path.exists() else []
        for entry in map(json.loads, lines):
            draw = Draw(entry["material"], entry["seed"], entry["resolution"])
            self._keep(draw, entry["method"], entry["shots"], Scores(**entry["scores"]))

    def draws(self) -> list[Draw]:
        return list(self._rows)

    def rows(self, draw: Draw) -> Rows:
        return self._rows.get(draw, {})

    def add(self, draw: Draw, method: str, shots: int, scores: Scores) -> None:
        self._keep(draw, method, shots, scores)
        if self._path:
            entry = asdict(draw) | {"method": method, "shots": shots, "scores": asdict(scores)}
            with self._path.open("a") as file:
                file.write(json.dumps(entry) + "\n")

    def _keep(self, draw: Draw, method: str, shots: int, scores: Scores) -> None:
        self._rows.setdefault(draw, {}).setdefault(method, {})[shots] = scores


def evaluate(
    load: Callable[[], Maps], draw: Draw, counts: Sequence[int], methods: Sequence[str], log: Log
) -> Rows:
    """Scores by method and number of shots, those of the log without making the maps again.

    load: the material; the truth is that, area-reduced to the draw's resolution, and so are maps of
    more pixels. Raises LookupError when no package has registered a rig.
    """
    known = log.rows(draw)
    missing = [m for m in methods if not set(counts) <= set(known.get(m, {}))]
    if missing:
        material = load()
        side = draw.resolution
        truth = materials.reduced(material, side, side)
        shown = renderings(truth)
        for method, count, maps in _rig()(material, draw.resolution, counts, draw.seed, missing):
            sized = materials.reduced(maps, side, side)
            log.add(draw, method, count, score(sized, truth, shown))
    return {m: {n: log.rows(draw)[m][n] for n in counts} for m in methods}


def _rig() -> Rig:
    found = list(entry_points(group="svbrdf.rigs"))
    if not found:
        raise LookupError(
            "No rig is installed to evaluate on; install turnlight in this environment."
        )
    rig: Rig = found[0].load()
    return rig
