"""The BRDF in plain Python floats, and the test vectors made with it that every renderer reads.

    .venv/bin/python tests/model/brdf_vectors.py        # writes brdf_vectors.json anew

A vector is one patch under one light: `f` is the BRDF in 1/sr, `radiance` is f x max(n.l, 0) at an
irradiance of 1. Directions are unit vectors.
"""

import json
import math
import random
from collections.abc import Iterator
from pathlib import Path

PATH = Path(__file__).with_suffix(".json")
RANDOM_VECTORS = 200
Vector = list[float]
UP: Vector = [0.0, 0.0, 1.0]
SLANTED: Vector = [math.sin(0.5), 0.0, math.cos(0.5)]


def vectors() -> list[dict[str, object]]:
    """Every limit and clamp once, then random patches."""
    return [_vector(*case) for case in (*_limits(), *_random())]


def shade(
    normal: Vector, light: Vector, view: Vector, diffuse: Vector, roughness: float, specular: Vector
) -> tuple[Vector, Vector]:
    """f and f x max(n.l, 0), three channels each."""
    half = _unit([a + b for a, b in zip(light, view, strict=True)])
    n_h, n_l, n_v, v_h = (
        min(max(_dot(a, b), 0.001), 1.0)
        for a, b in ((normal, half), (normal, light), (normal, view), (view, half))
    )
    alpha = max(roughness, 0.03) ** 2
    d = alpha**2 / (math.pi * (n_h**2 * (alpha**2 - 1) + 1) ** 2)
    k = alpha / 2
    v = 1 / ((n_l * (1 - k) + k) * (n_v * (1 - k) + k))
    schlick = 2 ** ((-5.55473 * v_h - 6.98316) * v_h)
    f = [
        albedo * (1 - s) / math.pi + (s + (1 - s) * schlick) * d * v / 4
        for albedo, s in zip(diffuse, specular, strict=True)
    ]
    return f, [value * max(_dot(normal, light), 0.0) for value in f]


def _limits() -> Iterator[tuple[Vector, Vector, Vector, Vector, float, Vector]]:
    grey, plastic, gold = [0.5] * 3, [0.04] * 3, [1.0, 0.78, 0.34]
    mirrored = [-SLANTED[0], 0.0, SLANTED[2]]
    for roughness in (0.0, 0.03, 0.2, 0.5, 1.0):
        yield UP, UP, UP, grey, roughness, plastic
        yield UP, SLANTED, mirrored, [0.0] * 3, roughness, gold
    grazing = _unit([1.0, 0.0, 1e-4])
    for light, view in ((grazing, UP), (UP, grazing), (grazing, [-grazing[0], 0.0, grazing[2]])):
        yield UP, light, view, grey, 0.4, plastic
    away = _unit([-2.0, 0.3, 0.4])
    yield away, SLANTED, UP, grey, 0.4, plastic  # lit from behind
    yield away, _unit([-1.0, 0.0, 0.5]), SLANTED, grey, 0.4, plastic  # seen from behind
    yield UP, SLANTED, UP, [1.0] * 3, 0.5, [1.0] * 3
    yield UP, SLANTED, UP, [0.0] * 3, 0.5, [0.0] * 3


def _random() -> Iterator[tuple[Vector, Vector, Vector, Vector, float, Vector]]:
    source = random.Random(0)
    for number in range(RANDOM_VECTORS):
        view, light = _direction(source), _direction(source)
        normal = _unit([source.gauss(0, 0.3), source.gauss(0, 0.3), 1.0])
        if number % 2:  # the half that is near the highlight, where a mistake shows
            light = _unit(
                [2 * _dot(normal, view) * n - v for n, v in zip(normal, view, strict=True)]
            )
            light[2] = abs(light[2])
        colour = [[source.random() for _ in range(3)] for _ in range(2)]
        yield normal, light, view, colour[0], source.random(), colour[1]


def _vector(
    normal: Vector, light: Vector, view: Vector, diffuse: Vector, roughness: float, specular: Vector
) -> dict[str, object]:
    f, radiance = shade(normal, light, view, diffuse, roughness, specular)
    return {
        "normal": normal,
        "to_light": light,
        "to_view": view,
        "diffuse": diffuse,
        "roughness": roughness,
        "specular": specular,
        "f": f,
        "radiance": radiance,
    }


def _direction(source: random.Random) -> Vector:
    return _unit([source.gauss(0, 1), source.gauss(0, 1), abs(source.gauss(0, 1)) + 0.1])


def _unit(vector: Vector) -> Vector:
    length = math.sqrt(_dot(vector, vector))
    return [value / length for value in vector]


def _dot(a: Vector, b: Vector) -> float:
    return sum(x * y for x, y in zip(a, b, strict=True))


if __name__ == "__main__":
    lines = ",\n".join(json.dumps(vector) for vector in vectors())
    PATH.write_text(f"[\n{lines}\n]\n")
