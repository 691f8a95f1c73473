import sys

import pytest

torch = pytest.importorskip("torch")

from svbrdf import checkpoint, train  # noqa: E402
from svbrdf.network import Network  # noqa: E402
from svbrdf.network_config import EDGE  # noqa: E402


@pytest.fixture(autouse=True)
def denormals():
    """Training flushes them to zero in the whole process; other tests want them."""
    yield
    torch.set_flush_denormal(False)


def told(monkeypatch, options):
    """The command's arguments; all trainings here are small."""
    small = "--resolution 64 --procedural 2 --device cpu --eager"
    monkeypatch.setattr(sys, "argv", ["train", *options.split(), *small.split()])


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_training_that_was_cut_off_goes_on_where_it_was(tmp_path, monkeypatch):
    out = tmp_path / "run.pt"
    told(monkeypatch, f"--out {out} --steps 4 --save-every 2 --pictures 12 --decodes 4")
    firsts = []
    run = train.Trainer.run

    def cut_off(trainer, first, count):
        firsts.append(first)
        if firsts == [0, 2]:
            raise KeyboardInterrupt
        return run(trainer, first, count)

    monkeypatch.setattr(train.Trainer, "run", cut_off)
    with pytest.raises(KeyboardInterrupt):
        train.main()
    assert checkpoint.load(out)[3][-1]["steps"] == 2
    train.main()
    assert firsts == [0, 2, 2]
    (record,) = checkpoint.load(out)[3]
    assert record["steps"] == 4


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_the_decoder_alone_can_be_trained(tmp_path, monkeypatch):
    start, out = tmp_path / "start.pt", tmp_path / "run.pt"
    network = Network(EDGE)
    checkpoint.save(start, EDGE, network, network, [])
    options = f"--start {start} --out {out} --steps 1 --pictures 12 --decodes 4 --decoder-only"
    told(monkeypatch, options)
    train.main()
    before, after = (checkpoint.load(path)[1].state_dict() for path in (start, out))
    changed = {name.partition(".")[0] for name in before if not before[name].equal(after[name])}
    assert changed == {"decoder"}


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_gradient_that_is_not_finite_stops_it_and_is_not_saved(tmp_path, monkeypatch):
    out = tmp_path / "run.pt"
    told(monkeypatch, f"--out {out} --steps 3 --save-every 1 --pictures 3 --decodes 2 --counts 3")
    calls, loss = [], train.loss

    def broken(*args):
        calls.append(0)
        return loss(*args) * (float("nan") if len(calls) == 2 else 1)

    monkeypatch.setattr(train, "loss", broken)
    with pytest.raises(train.TrainingError, match="step 1 is not finite"):
        train.main()
    assert checkpoint.load(out)[3][-1]["steps"] == 1
