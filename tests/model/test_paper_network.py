"""The published network against a second implementation, in numpy, written from the paper's description."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from svbrdf.network import Network  # noqa: E402
from svbrdf.network_config import NetworkConfig  # noqa: E402

WIDTH, SIDE = 2, 256


class Reference:
    """The network as loops over named weights; nothing but numpy."""

    def __init__(self, weights):
        self.weights = {name: value.numpy().astype(np.float64) for name, value in weights.items()}

    def maps(self, pictures):
        states = [self.encode(p) for p in pictures]
        return self.decode(*(np.maximum.reduce(parts) for parts in zip(*states, strict=True)))

    def encode(self, picture):
        height, width = picture.shape[1:]
        log = (np.log(picture**2.2 + 0.01) - np.log(0.01)) / (np.log(1.01) - np.log(0.01)) * 2 - 1
        x = np.broadcast_to(((np.arange(width) + 0.5) / width * 2 - 1)[None], (height, width))
        y = np.broadcast_to((1 - (np.arange(height) + 0.5) / height * 2)[:, None], (height, width))
        m = np.concatenate([log, x[None], y[None]])
        g = selu(self.linear("encoder.start", m.mean(axis=(1, 2))))
        skips = []
        for i in range(8):
            name = f"encoder.unet.down.{i}"
            m = convolve(
                m if i == 0 else leaky(m), self.weights[f"{name}.convolution.weight"], 2, (1, 1)
            )
            if i > 0:
                m, g = self.exchange(name, m, g, norm=i < 7)
            skips.append(m)
        for i in range(8):
            name = f"encoder.unet.up.{i}"
            m = m if i == 0 else np.concatenate([m, skips[7 - i]])
            m = leaky(m).repeat(2, axis=1).repeat(2, axis=2)
            for j in range(2):
                kernel = self.weights[f"{name}.convolution.convolutions.{j}.weight"]
                m = convolve(m, kernel, 1, (1, 2))
            m, g = self.exchange(name, m, g, norm=i < 7)
        return m, g

    def decode(self, m, g):
        before = m
        m = m + (self.weights["decoder.exchange.weight"] @ g)[:, None, None]
        g = selu(self.linear("decoder.update", np.concatenate([g, before.mean(axis=(1, 2))])))
        for name, activate in (("first", False), ("second", True)):
            m = leaky(m) if activate else m
            m = convolve(m, self.weights[f"decoder.{name}.convolution.weight"], 1, (1, 1))
            m, g = self.exchange(f"decoder.{name}", m, g, norm=True)
        m = convolve(leaky(m), self.weights["decoder.last.weight"], 1, (1, 1))
        out = np.tanh(m + self.weights["decoder.last.bias"][:, None, None])
        normal = np.concatenate([3 * out[:2], np.ones_like(out[:1])])
        return np.concatenate([normal / np.linalg.norm(normal, axis=0), (out[2:] + 1) / 2])

    def exchange(self, name, m, g, norm):
        mean = m.mean(axis=(1, 2))
        if norm:
            variance = m.var(axis=(1, 2), keepdims=True)
            m = (m - mean[:, None, None]) / np.sqrt(variance + 1e-5)
            scale, shift = (self.weights[f"{name}.norm.{part}"] for part in ("weight", "bias"))
            m = m * scale[:, None, None] + shift[:, None, None]
        m = m + (self.weights[f"{name}.exchange.weight"] @ g)[:, None, None]
        return m, selu(self.linear(f"{name}.update", np.concatenate([g, mean])))

    def linear(self, name, vector):
        return self.weights[f"{name}.weight"] @ vector + self.weights[f"{name}.bias"]


def leaky(x):
    return np.where(x > 0, x, 0.2 * x)


def selu(x):
    return 1.0507009873554805 * np.where(x > 0, x, 1.6732632423543772 * np.expm1(np.minimum(x, 0)))


def convolve(image, kernel, stride, pad):
    image = np.pad(image, ((0, 0), pad, pad))
    size = kernel.shape[-1]
    windows = np.lib.stride_tricks.sliding_window_view(image, (size, size), axis=(1, 2))
    return np.einsum("ihwkl,oikl->ohw", windows[:, ::stride, ::stride], kernel, optimize=True)


def test_a_narrow_paper_network_agrees_with_the_reference():
    torch.manual_seed(3)
    network = Network(NetworkConfig(width=WIDTH, features=WIDTH, final=(WIDTH, WIDTH // 2)))
    pictures = torch.rand(2, 3, SIDE, SIDE)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(0.1 * torch.randn_like(parameter))
        ours = network(pictures[None])
        theirs = Reference(network.state_dict()).maps(pictures.numpy().astype(np.float64))
    together = torch.cat([ours.normal, ours.diffuse, ours.roughness, ours.specular], dim=-1)[0]
    np.testing.assert_allclose(together.numpy(), theirs.transpose(1, 2, 0), atol=1e-4)
