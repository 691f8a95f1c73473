"""Weights on disk: what is not such a file is refused with a sentence."""

import pytest

torch = pytest.importorskip("torch")

from svbrdf import checkpoint  # noqa: E402
from svbrdf.network import Network  # noqa: E402
from svbrdf.network_config import EDGE  # noqa: E402


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(checkpoint.CheckpointError, match=r"no checkpoint .*none\.pt"):
        checkpoint.load(tmp_path / "none.pt")


def test_what_is_no_checkpoint_and_one_of_another_version_are_refused(tmp_path):
    text, other = tmp_path / "text.pt", tmp_path / "other.pt"
    text.write_text("not weights")
    network = Network(EDGE)
    checkpoint.save(other, EDGE, network, network, [])
    content = torch.load(other, weights_only=True)
    del content["config"]["squeeze"]
    torch.save(content, other)
    for path in (text, other):
        with pytest.raises(checkpoint.CheckpointError, match="another version"):
            checkpoint.load(path)
