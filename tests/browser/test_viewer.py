"""The mailed viewer in a browser: what it shows is what svbrdf.renderer computes, and it can be used."""

import base64
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from svbrdf import maps as uniform
from svbrdf import procedural, renderer
from svbrdf.lighting import Light, Lighting
from svbrdf.maps import Maps
from turnlight.capture.relight import relit
from turnlight.export import viewer
from turnlight.export.provenance import Provenance
from turnlight.export.resample import resampled
from turnlight.export.subject import Subject
from turnlight.export.viewer import html
from turnlight.picture.picture import Picture

VECTORS = json.loads((Path(__file__).parents[1] / "model/brdf_vectors.json").read_text())
RESOLUTION = 128

DRAW = """
async ([size, light, view, power, material, shown]) => {
  const { Relighter } = await import("turnlight/relight.js");
  const { unpack } = await import("turnlight/maps.js");
  const content = JSON.parse(document.getElementById("content").textContent);
  const canvas = new OffscreenCanvas(size, size);
  const relighter = new Relighter(canvas);
  relighter.draw({
    material: relighter.material(await unpack(content[material])),
    light, view, power, shown, origin: [-1, -1], step: [2 / size, 2 / size],
  });
  const gl = relighter.gl;
  const pixels = new Uint8Array(size * size * 4);
  gl.readPixels(0, 0, size, size, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  let text = "";
  for (const value of pixels) text += String.fromCharCode(value);
  return btoa(text);
}
"""

SHADE = """
async (vectors) => {
  const { BRDF } = await import("turnlight/brdf.js");
  const { link } = await import("turnlight/relight.js");
  const gl = new OffscreenCanvas(1, 1).getContext("webgl2");
  gl.getExtension("EXT_color_buffer_float");
  const program = link(gl, `#version 300 es
    void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`,
    `#version 300 es
    precision highp float;
    ${BRDF}
    uniform vec3 normal, toLight, toView, diffuse, specular;
    uniform float roughness;
    out vec4 colour;
    void main() {
      colour = vec4(shade(normal, toLight, toView, diffuse, roughness, specular, vec3(1.0)), 1.0);
    }`);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  const target = gl.createFramebuffer();
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, 1, 1);
  gl.bindFramebuffer(gl.FRAMEBUFFER, target);
  gl.framebufferTexture2D(
    gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, gl.getParameter(gl.TEXTURE_BINDING_2D), 0);
  gl.useProgram(program);
  const at = (name) => gl.getUniformLocation(program, name);
  return vectors.map((v) => {
    gl.uniform3fv(at("normal"), v.normal);
    gl.uniform3fv(at("toLight"), v.to_light);
    gl.uniform3fv(at("toView"), v.to_view);
    gl.uniform3fv(at("diffuse"), v.diffuse);
    gl.uniform3fv(at("specular"), v.specular);
    gl.uniform1f(at("roughness"), v.roughness);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const result = new Float32Array(4);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.FLOAT, result);
    return [...result].slice(0, 3);
  });
}
"""


@pytest.fixture(scope="module")
def metal() -> Maps:
    rock = procedural.material(3, RESOLUTION)
    gold = np.array([1.0, 0.78, 0.34], np.float32) * (0.8 + 0.2 * rock.diffuse)
    return Maps(rock.normal, 0.05 * rock.diffuse, 0.6 * rock.roughness, gold)


def show(page: Any, maps: Maps, folder: Path, *, tiles: bool = False) -> None:
    path = folder / "viewer.html"
    path.write_bytes(html(Subject(maps, Provenance("A </script> & sample", 100.0)), tiles=tiles))
    page.goto(path.as_uri())
    page.wait_for_function("window.turnlight !== undefined")


def drawn(page: Any, size: int, light: Any, view: Any, power: float, shown: str = "relit") -> Any:
    coded = page.evaluate(DRAW, [size, list(light), list(view), power, "maps", shown])
    pixels = np.frombuffer(base64.b64decode(coded), np.uint8).reshape(size, size, 4)
    return pixels[::-1, :, :3]


def within_two(ours: npt.NDArray[np.uint8], theirs: npt.NDArray[np.uint8]) -> float:
    apart = np.abs(ours.astype(int) - theirs.astype(int)).max(axis=-1)
    return float((apart <= 2).mean())


def test_the_shader_computes_the_test_vectors(page: Any, metal: Maps, tmp_path: Path) -> None:
    show(page, metal, tmp_path)
    ours = np.array(page.evaluate(SHADE, VECTORS))
    expected = np.array([vector["radiance"] for vector in VECTORS])
    np.testing.assert_allclose(ours, expected, rtol=2e-3, atol=1e-6)


@pytest.mark.parametrize("seed", [1, 3, None])
@pytest.mark.parametrize("light", [(-1.7, 1.7, 2.4), (0.3, -0.2, 0.8), (2.5, 0.5, 0.4)])
def test_the_relit_view_is_the_renderers(
    page: Any, metal: Maps, tmp_path: Path, seed: int | None, light: tuple[float, float, float]
) -> None:
    maps = metal if seed is None else procedural.material(seed, RESOLUTION)
    show(page, maps, tmp_path)
    ours = drawn(page, RESOLUTION, light, (0, 0, 4), float(np.sum(np.square(light))))
    assert within_two(ours, relit(maps, light)) >= 0.99


def test_an_oblique_view_too(page: Any, metal: Maps, tmp_path: Path) -> None:
    show(page, metal, tmp_path)
    light, view = np.float32([0.4, 1.9, 1.6]), np.float32([-0.9, -1.8, 2.5])
    ours = drawn(page, RESOLUTION, light.tolist(), view.tolist(), 6.0)
    positions = renderer.pixel_positions(np, RESOLUTION, RESOLUTION, dtype=np.float32)
    irradiance = np.pi * 6.0 / np.sum((light - positions) ** 2, axis=-1, keepdims=True)
    linear = renderer.render(metal, light, view, irradiance)
    theirs = np.rint(np.clip(linear, 0, 1) ** (1 / 2.2) * 255).astype(np.uint8)
    assert within_two(ours, theirs) >= 0.99


def test_from_afar_it_shows_what_resampling_gives(page: Any, metal: Maps, tmp_path: Path) -> None:
    show(page, metal, tmp_path)
    small = RESOLUTION // 4
    light = (0.5, 0.9, 1.5)
    ours = drawn(page, small, light, (0, 0, 4), float(np.sum(np.square(light))))
    assert within_two(ours, relit(resampled(metal, small, small), light)) >= 0.97


def test_maps_are_shown_as_they_are(page: Any, metal: Maps, tmp_path: Path) -> None:
    show(page, metal, tmp_path)
    ours = drawn(page, RESOLUTION, (0, 0, 1), (0, 0, 4), 1.0, "roughness")
    theirs = np.rint(np.repeat(metal.roughness, 3, axis=-1) * 255).astype(np.uint8)
    assert within_two(ours, theirs) == 1


def test_pointer_and_wheel(page: Any, metal: Maps, tmp_path: Path) -> None:
    show(page, metal, tmp_path)
    page.mouse.move(450, 250)
    first = page.screenshot()
    aimed = page.evaluate("turnlight.state.pointer")
    assert aimed == page.evaluate("turnlight.camera.sampleAt(450, 250)")
    page.mouse.move(560, 330)
    page.wait_for_timeout(300)
    assert page.screenshot() != first
    page.mouse.wheel(0, -600)
    page.wait_for_function("turnlight.camera.magnification > 2")
    under = page.evaluate("turnlight.camera.sampleAt(560, 330)")
    assert under == pytest.approx(page.evaluate("turnlight.state.pointer"), abs=1e-6)
    page.keyboard.press("0")
    assert page.evaluate("turnlight.camera.magnification") == 1
    page.keyboard.press("3")
    assert page.evaluate("turnlight.state.shown") == "diffuse"


def test_it_says_where_it_comes_from_and_how_large_it_is(
    page: Any, metal: Maps, tmp_path: Path
) -> None:
    show(page, metal, tmp_path)
    assert page.title() == "A </script> & sample"
    told = page.evaluate("JSON.parse(document.getElementById('provenance').textContent)")
    assert told["side_mm"] == 100
    assert told["sample"] == "A </script> & sample"
    bar = page.evaluate("document.getElementById('bar').getBoundingClientRect().width")
    millimetres = float(page.inner_text("#length").split()[0])
    shown = page.evaluate("turnlight.camera.scale * 2")
    assert bar / shown * 100 == pytest.approx(millimetres, rel=0.02)
    page.click("#about")
    assert page.inner_text("dl").count("100 × 100 mm") == 1
    assert page.is_hidden("[data-compare=photo]")


def test_tiles_are_repeated(page: Any, metal: Maps, tmp_path: Path) -> None:
    show(page, metal, tmp_path, tiles=True)
    page.click("#tiled")
    assert page.evaluate("turnlight.camera.extent()") == [3, 3]


def test_split_with_a_photo_and_before(
    page: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A photo that the renderer took of the same maps: left and right of the divider are alike."""
    sample = procedural.material(3, RESOLUTION)
    view = np.float32([0.3, -1.6, 2.4])
    light = Light(np.float32([-0.5, 1.2, 1.9]), np.full((1, 1, 1), 0.7, np.float32))
    photo = renderer.render(sample, light.position, view, np.float32(0.7 * np.pi))
    seen = np.ones(photo.shape[:2], bool)
    picture = Picture(photo, 1.0, seen, photo.max(axis=-1) >= 1, Lighting(view, (light,)))
    flat = uniform.flat(RESOLUTION, RESOLUTION)
    monkeypatch.setattr(viewer, "_shots", lambda _: [viewer._Shot("A photo", picture)])
    monkeypatch.setattr(viewer, "_before", lambda *_: flat)
    session: Any = SimpleNamespace(manifest=SimpleNamespace(refinement=None, used=(1,)))
    path = tmp_path / "viewer.html"
    path.write_bytes(html(Subject(sample, Provenance("rock", 50.0), session), tiles=False))
    page.goto(path.as_uri())
    page.wait_for_function("window.turnlight !== undefined")

    def canvas() -> npt.NDArray[np.float32]:
        page.wait_for_timeout(400)
        shot = page.locator("#canvas").screenshot()
        shot = cv2.imdecode(np.frombuffer(shot, np.uint8), cv2.IMREAD_COLOR)
        return np.asarray(shot[200:480, 320:580], np.float32)

    page.click("[data-compare=photo]")
    assert page.inner_text("#left") == "Photo"
    page.evaluate("turnlight.state.divider = 0.05, turnlight.redraw()")
    relit_side = canvas()
    page.evaluate("turnlight.state.divider = 0.95, turnlight.redraw()")
    photo_side = canvas()
    assert np.abs(relit_side - photo_side).mean() < 6
    page.click("[data-compare=before]")
    assert page.inner_text("#left") == "After one photo"
    assert np.abs(canvas() - relit_side).mean() > 20
    page.click("[data-compare=off]")
    after = canvas()
    page.keyboard.press("b")
    assert np.abs(canvas() - after).mean() > 20
