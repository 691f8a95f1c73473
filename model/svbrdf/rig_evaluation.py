"""Scores of every method on pictures of a rig whose calibration is off: `svbrdf.evaluate --rig`.

The rig itself comes from whatever package has registered one in the entry point group svbrdf.rigs: a
function (material, resolution, counts, seed, methods) -> iterator of (method, count, maps).
"""

from collections.abc import Callable, Iterator, Sequence
from importlib.metadata import entry_points

from svbrdf import materials
from svbrdf.maps import Maps
from svbrdf.scores import Scores, renderings, score

METHODS = ("no model", "network without poses", "network with poses", "classical", "refinement")
COUNTS = (1, 2, 3, 5, 10, 20)
Rig = Callable[[Maps, int, Sequence[int], int, Sequence[str]], Iterator[tuple[str, int, Maps]]]


def evaluate(
    material: Maps, resolution: int, counts: Sequence[int], seed: int, methods: Sequence[str]
) -> dict[str, dict[int, Scores]]:
    """Scores by method and number of shots; the truth is the material area-reduced to `resolution`.

    seed: of the calibration's errors. Raises LookupError when no package has registered a rig.
    """
    truth = materials.reduced(material, resolution)
    shown = renderings(truth)
    rows: dict[str, dict[int, Scores]] = {method: {} for method in methods}
    for method, count, maps in _rig()(material, resolution, counts, seed, methods):
        rows[method][count] = score(maps, truth, shown)
    return rows


def _rig() -> Rig:
    found = list(entry_points(group="svbrdf.rigs"))
    if not found:
        raise LookupError(
            "No rig is installed to evaluate on; install turnlight in this environment."
        )
    rig: Rig = found[0].load()
    return rig
