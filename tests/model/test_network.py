import copy
import json
from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from svbrdf import checkpoint, export_onnx, procedural, scenes  # noqa: E402
from svbrdf.encoding import log_decoding, log_encoding, shading_cue  # noqa: E402
from svbrdf.lighting import Light, Lighting  # noqa: E402
from svbrdf.loss import loss  # noqa: E402
from svbrdf.network import Network  # noqa: E402
from svbrdf.network_config import EDGE, PAPER, NetworkConfig  # noqa: E402
from svbrdf.onnx_model import OnnxModel, WeightsError  # noqa: E402

TOY = NetworkConfig(
    width=4, levels=3, widest=2, stem=2, features=6, decoder_convolutions=1, decoder_kernel=3,
    final_norms=False, raw=True, final=(6, 6), fused_width=4, squeeze=(8, 6),
)  # fmt: skip


def test_the_paper_network_has_the_published_number_of_parameters():
    with torch.device("meta"):
        assert sum(p.numel() for p in Network(PAPER).parameters()) == 80_776_722


def test_a_narrow_paper_network_runs_and_gives_maps_in_range():
    torch.manual_seed(0)
    maps = Network(NetworkConfig(width=4, features=4, final=(4, 4)))(torch.rand(1, 2, 3, 256, 256))
    assert maps.diffuse.shape == (1, 256, 256, 3)
    assert torch.allclose(maps.normal.norm(dim=-1), torch.ones(1, 256, 256), atol=1e-5)
    assert 0 <= maps.roughness.min() <= maps.roughness.max() <= 1


def test_log_encoding_spans_minus_one_to_one_and_inverts():
    values = torch.linspace(0, 1, 11)
    encoded = log_encoding(values)
    assert encoded[0] == pytest.approx(-1, abs=1e-5)
    assert encoded[-1] == pytest.approx(1, abs=1e-5)
    assert torch.allclose(log_decoding(encoded), values**2.2, atol=1e-5)


def test_an_untrained_edge_network_is_the_guess_without_a_model():
    network = Network(EDGE)
    picture = torch.full((1, 2, 3, 64, 64), 0.5)
    picture[:, 1] = 0.8
    maps = network(picture)
    assert torch.allclose(maps.roughness, torch.tensor(0.5), atol=1e-4)
    assert torch.allclose(maps.specular, torch.tensor(0.04), atol=1e-4)
    assert (maps.diffuse > 0.5**2.2).all() and (maps.diffuse < 0.8**2.2).all()


def test_a_network_of_five_inputs_takes_them_together():
    torch.manual_seed(0)
    network = Network(replace(TOY, inputs=5, poses=True))
    torch.nn.init.normal_(network.decoder.last.weight, std=0.1)
    pictures = torch.rand(2, 5, 3, 32, 32)
    maps = network(pictures)
    assert maps.diffuse.shape == (2, 32, 32, 3)
    other = network(pictures[:, [1, 0, 2, 3, 4]])
    assert not torch.allclose(maps.roughness, other.roughness)


def test_the_loss_is_zero_for_the_truth_and_falls_with_training():
    torch.manual_seed(0)
    rng = torch.Generator().manual_seed(0)
    true = procedural.material(1, 32).map(lambda a: torch.from_numpy(a)[None])
    pairs = scenes.rendering_pairs(1, rng)
    assert pairs.light.shape == (1, 9, 3)
    assert abs(loss(true, true, pairs)) < 1e-6
    network = Network(TOY)
    pictures = scenes.shots(true, 3, rng, "paper").pictures
    assert pictures.shape == (1, 3, 3, 32, 32)
    optimizer = torch.optim.Adam(network.parameters(), 3e-3)
    values = []
    for _ in range(30):
        value = loss(network(pictures), true, pairs)
        optimizer.zero_grad()
        value.backward()
        optimizer.step()
        values.append(float(value.detach()))
    assert values[-1] < 0.9 * values[0]


@pytest.mark.parametrize("kind", ["paper", "handheld", "flash", "rig", "clean"])
def test_pictures_repeat_with_their_seed_and_are_eight_bit(kind):
    true = procedural.material(2, 32).map(lambda a: torch.from_numpy(a)[None])
    first, second = (
        scenes.shots(true, 4, torch.Generator().manual_seed(5), kind).pictures for _ in range(2)
    )
    assert torch.equal(first, second)
    assert torch.allclose((first * 255).round(), first * 255, atol=1e-4)
    assert first.max() > 0.1


def test_a_checkpoint_resumes(tmp_path):
    network = Network(TOY)
    checkpoint.save(tmp_path / "toy.pt", TOY, network, copy.deepcopy(network), [{"steps": 3}])
    config, raw, ema, history = checkpoint.load(tmp_path / "toy.pt")
    assert config == TOY and history == [{"steps": 3}]
    for name, value in network.state_dict().items():
        assert torch.allclose(raw.state_dict()[name], value, atol=1e-3)
        assert torch.allclose(ema.state_dict()[name], value, atol=1e-3)


@pytest.fixture(scope="module")
def toy_card(tmp_path_factory):
    torch.manual_seed(1)
    network = Network(TOY)
    torch.nn.init.normal_(network.decoder.last.weight, std=0.1)
    card = tmp_path_factory.mktemp("weights") / "toy.json"
    export_onnx.export(TOY, network, [], 32, card)
    return network, card


@pytest.mark.filterwarnings("ignore::FutureWarning", "ignore::DeprecationWarning")
def test_the_exported_graphs_agree_with_torch_in_any_order(toy_card):
    network, card = toy_card
    model = OnnxModel(card)
    rng = np.random.default_rng(0)
    pictures = [rng.integers(0, 256, (32, 32, 3), dtype=np.uint8) for _ in range(3)]
    results = []
    for order in ([0, 1, 2], [2, 0, 1], [1, 1, 2, 0, 0]):
        state = model.empty()
        for i in order:
            state = model.encode(state, pictures[i])
        results.append(model.decode(state))
    stacked = torch.from_numpy(np.stack(pictures)).permute(0, 3, 1, 2)[None] / 255
    with torch.no_grad():
        reference = network(stacked)
    for name in ("normal", "diffuse", "roughness", "specular"):
        first = getattr(results[0], name)
        np.testing.assert_allclose(first, getattr(reference, name)[0].numpy(), atol=1e-4)
        for other in results[1:]:
            np.testing.assert_array_equal(getattr(other, name), first)


@pytest.mark.filterwarnings("ignore::FutureWarning", "ignore::DeprecationWarning")
def test_the_exported_graphs_take_poses_as_torch_does(tmp_path):
    torch.manual_seed(2)
    config = replace(TOY, poses=True)
    network = Network(config)
    torch.nn.init.normal_(network.decoder.last.weight, std=0.1)
    export_onnx.export(config, network, [], 64, tmp_path / "toy.json")
    model = OnnxModel(tmp_path / "toy.json")
    rng = torch.Generator().manual_seed(0)
    true = procedural.material(3, 64).map(lambda a: torch.from_numpy(a)[None])
    shots = scenes.shots(true, 3, rng, "rig")
    with torch.no_grad():
        reference = network(shots.pictures, scenes.known(shots, rng, scenes.Knowledge()))
    state = model.empty()
    for i in range(3):
        picture = (shots.pictures[0, i].permute(1, 2, 0).numpy() * 255).round().astype(np.uint8)
        light, view = (p[0, i].numpy() for p in (shots.poses.light, shots.poses.view))
        white = shots.white[0, i].permute(1, 2, 0).numpy()
        state = model.encode(state, picture, Lighting(view, (Light(light, white),)))
    maps = model.decode(state)
    for name in ("normal", "diffuse", "roughness", "specular"):
        np.testing.assert_allclose(
            getattr(maps, name), getattr(reference, name)[0].numpy(), atol=2e-3
        )


@pytest.mark.filterwarnings("ignore::FutureWarning", "ignore::DeprecationWarning")
def test_damaged_weights_are_named(toy_card, tmp_path):
    _, card = toy_card
    copy_card = tmp_path / "toy.json"
    copy_card.write_text(card.read_text())
    with pytest.raises(WeightsError, match="missing"):
        OnnxModel(copy_card)
    (tmp_path / "toy-encode.onnx").write_bytes(b"not a graph")
    with pytest.raises(WeightsError, match="differ from their card"):
        OnnxModel(copy_card)


def test_the_shipped_weights_match_their_card():
    model = OnnxModel()
    assert model.resolution == 256
    assert json.dumps(model.card["network"])


def test_the_shading_cue_tells_slopes_without_training():
    """Max plus min over pictures of the cue follows the true slopes of an untextured relief."""
    relief = procedural.material(2_000_053, 64).map(lambda a: torch.from_numpy(a)[None])
    rng = torch.Generator().manual_seed(0)
    pictures = scenes.shots(relief, 8, rng, "rig").pictures[0]
    _, cue = shading_cue(log_encoding(pictures))
    slopes = (relief.normal[0, ..., :2] / relief.normal[0, ..., 2:]).permute(2, 0, 1)
    told = cue.amax(dim=0) + cue.amin(dim=0)
    agreement = torch.corrcoef(torch.stack([told.flatten(), slopes.flatten()]))[0, 1]
    assert agreement > 0.5
