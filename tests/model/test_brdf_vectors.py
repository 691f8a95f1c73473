"""Every form of the BRDF reads brdf_vectors.json: here numpy and torch, elsewhere the kernel and GLSL."""

import importlib.util
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from svbrdf.maps import Maps
from svbrdf.renderer import brdf, shade

FILE = Path(__file__).with_name("brdf_vectors.json")
VECTORS = json.loads(FILE.read_text())


def column(name: str, kind: type = np.float64) -> Any:
    """(vectors, 1, n)"""
    return np.array([vector[name] for vector in VECTORS], kind).reshape(len(VECTORS), 1, -1)


def maps(kind: type) -> Maps:
    return Maps(*(column(name, kind) for name in ("normal", "diffuse", "roughness", "specular")))


def test_the_file_is_what_the_script_writes() -> None:
    spec = importlib.util.spec_from_file_location("brdf_vectors", FILE.with_suffix(".py"))
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    assert script.vectors() == VECTORS


def test_numpy() -> None:
    light, view = column("to_light"), column("to_view")
    np.testing.assert_allclose(brdf(maps(np.float64), light, view), column("f"), rtol=1e-9)
    radiance = shade(maps(np.float64), light, view, 1.0)
    np.testing.assert_allclose(radiance, column("radiance"), rtol=1e-9, atol=1e-12)


def test_numpy_in_single_precision() -> None:
    """A highlight sharper than roughness 0.2 has a peak that single precision cannot resolve."""
    blunt = column("roughness")[:, 0, 0] >= 0.2
    light, view = column("to_light", np.float32), column("to_view", np.float32)
    ours = brdf(maps(np.float32), light, view)[blunt]
    np.testing.assert_allclose(ours, column("f")[blunt], rtol=2e-3)


def test_torch() -> None:
    torch = pytest.importorskip("torch")
    light, view = (torch.from_numpy(column(name)) for name in ("to_light", "to_view"))
    radiance = shade(maps(np.float64).map(torch.from_numpy), light, view, 1.0)
    np.testing.assert_allclose(radiance.numpy(), column("radiance"), rtol=1e-9, atol=1e-12)
