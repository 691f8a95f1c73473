import json
import sys

import cv2
import pytest

pytest.importorskip("matplotlib")

from svbrdf import figures

LOG = [{"train_seconds": 60.0 * i, "loss": 1 / (1 + i)} for i in range(4)]
SCORE = dict.fromkeys(figures.PANELS, 0.5)


@pytest.mark.parametrize(
    ("option", "content"),
    [
        ("--log", "\n".join(map(json.dumps, LOG))),
        ("--scores", json.dumps({"model": {"1": SCORE, "5": SCORE}, "no model": {"1": SCORE}})),
    ],
)
def test_a_figure_is_drawn_the_same_each_time(option, content, tmp_path, monkeypatch):
    source = tmp_path / "source.json"
    source.write_text(content)
    pictures = []
    for name in ("a.png", "b.png"):
        out = tmp_path / name
        monkeypatch.setattr(sys, "argv", ["figures", option, str(source), "--out", str(out)])
        figures.main()
        pictures.append(out.read_bytes())
    assert pictures[0] == pictures[1]
    assert cv2.imread(str(tmp_path / "a.png")).std() > 1
