import json
from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from svbrdf import checkpoint, compare  # noqa: E402
from svbrdf.network import Network  # noqa: E402
from svbrdf.network_config import EDGE  # noqa: E402

TOY = replace(
    EDGE, width=4, levels=3, widest=2, features=4, final=(4, 4), fused_width=4, squeeze=(6, 4)
)
PICTURES = np.random.default_rng(0).integers(0, 256, (6, 32, 32, 3), dtype=np.uint8)


def maps_of(model, pictures):
    state = model.empty()
    for picture in pictures:
        state = model.encode(state, picture, None)
    return model.decode(state)


def different_everywhere(network):
    """An output layer of zeros would make every network's maps the guess without one."""
    torch.manual_seed(1)
    torch.nn.init.normal_(network.decoder.last.weight, std=0.03)
    return network


@pytest.fixture
def network():
    torch.manual_seed(0)
    return different_everywhere(Network(TOY))


def test_single_pictures_maps_are_averaged(network):
    single = compare.Trained("single", network, averaged=True)
    each = [maps_of(single, [picture]).diffuse for picture in PICTURES]
    maps = maps_of(single, PICTURES)
    assert maps.diffuse == pytest.approx(np.mean(each, axis=0), abs=1e-5)
    assert np.linalg.norm(maps.normal, axis=-1) == pytest.approx(1, abs=1e-5)


def test_several_pictures_are_one_sample(network):
    maps = maps_of(compare.Trained("edge", network), PICTURES)
    pictures = torch.from_numpy(PICTURES).permute(0, 3, 1, 2)[None].float() / 255
    with torch.no_grad():
        assert maps.diffuse == pytest.approx(network(pictures).diffuse[0].numpy(), abs=1e-6)


def test_a_network_of_five_sees_few_pictures_again():
    five = compare.Trained("five", different_everywhere(Network(replace(TOY, inputs=5))))
    two = maps_of(five, PICTURES[:2])
    again = maps_of(five, PICTURES[[0, 1, 0, 1, 0]])
    assert (two.diffuse == again.diffuse).all()


def test_as_many_steps_as_the_time_holds(tmp_path, monkeypatch):
    runs = []

    def run(out, options, length):
        runs.append((out.name, *length))
        out.with_suffix(".jsonl").write_text(json.dumps({"processor_s_per_step": 0.5}) + "\n")

    monkeypatch.setattr(compare, "_run", run)
    for _ in range(2):
        compare.train(tmp_path / "edge.pt", [], minutes=2)
    trial, first, again = runs
    checkpoint.save(tmp_path / "edge.pt", TOY, Network(TOY), Network(TOY), [{"steps": 240}])
    compare.train(tmp_path / "edge.pt", [], minutes=2)
    assert len(runs) == 3, "a finished training is not begun again"
    assert trial[0] == "edge.trial.pt"
    assert first == again == ("edge.pt", "--steps", "240", "--decay", "120", "--save-every", "50")
