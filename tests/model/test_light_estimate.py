import pytest

torch = pytest.importorskip("torch")

from svbrdf import light_estimate  # noqa: E402


def test_guesses_are_above_the_sample_whatever_the_picture():
    torch.manual_seed(0)
    guess = light_estimate.LightEstimate()
    for scale in (0.0, 1.0, 100.0):
        for position in guess(scale * torch.randn(4, 3, 64, 64)):
            assert (position[:, 2] > 0).all()
            assert 0.1 < position.norm(dim=1).min() <= position.norm(dim=1).max() < 100


def test_the_error_is_zero_for_the_truth_alone():
    light, view = torch.tensor([[0.5, 0.0, 2.0]]), torch.tensor([[0.0, 0.3, 3.0]])
    assert light_estimate.error((light, view), (light, view)) < 1e-6
    assert light_estimate.error((light, view), (view, light)) > 0.1
