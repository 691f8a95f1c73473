"""The shipped networks beside the published one, in one run: `make bench`.

Each runs in a process of its own, so that its memory is its own.
"""

import json
import subprocess
import sys
from pathlib import Path

import pytest

torch = pytest.importorskip("torch")

from svbrdf import export_onnx  # noqa: E402
from svbrdf.network import Network  # noqa: E402
from svbrdf.network_config import PAPER  # noqa: E402

WEIGHTS = Path(__file__).parents[2] / "model/svbrdf/weights"
MEASURE = """
import json, statistics, sys, time
from pathlib import Path
import numpy as np
from svbrdf.onnx_model import OnnxModel
model = OnnxModel(Path(sys.argv[1]), threads=2)
picture = np.random.default_rng(0).integers(0, 256, (256, 256, 3), dtype=np.uint8)
times = []
for _ in range(int(sys.argv[2])):
    start = time.perf_counter()
    state = model.encode(model.empty(), picture)
    model.decode(state)
    times.append(time.perf_counter() - start)
status = Path("/proc/self/status").read_text()  # getrusage would tell the peak of the parent, too
peak_mb = int(status.partition("VmHWM:")[2].split()[0]) / 1024
print(json.dumps({"ms": 1000 * statistics.median(times[2:]), "mb": peak_mb}))
"""


@pytest.mark.bench
@pytest.mark.timeout(600)
@pytest.mark.filterwarnings("ignore::FutureWarning", "ignore::DeprecationWarning")
def test_the_published_network_beside_ours(tmp_path):
    paper = tmp_path / "paper.json"
    export_onnx.export(PAPER, Network(PAPER), [], 256, paper)
    cards = {
        "paper, fp32": (paper, 8),
        "edge, fp32": (WEIGHTS / "edge.json", 20),
        "edge, int8": (WEIGHTS / "edge-int8.json", 20),
    }
    figures = {}
    for name, (card, runs) in cards.items():
        command = [sys.executable, "-c", MEASURE, str(card), str(runs)]
        figures[name] = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    slowest = figures["paper, fp32"]["ms"]
    print("\nencode + max + decode of one picture, two threads; peak memory of the whole process")
    for name, figure in figures.items():
        speed = slowest / figure["ms"]
        print(f"  {name:<12}{figure['ms']:8.1f} ms  {speed:5.1f}x  {figure['mb']:6.0f} MB")
    assert slowest / figures["edge, fp32"]["ms"] >= 4
    assert slowest / figures["edge, int8"]["ms"] >= 8
