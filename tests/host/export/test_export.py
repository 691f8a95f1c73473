"""Exports: what comes back is what went in, other programs find no fault, and everything says what it is."""

import hashlib
import json
import os
import shutil
import subprocess
from pathlib import Path

import MaterialX
import numpy as np
import pytest
from host.export import reading
from typer.testing import CliRunner

from svbrdf import materials
from svbrdf.maps import Maps
from turnlight import cli
from turnlight.errors import ExportError, SessionError
from turnlight.export.export import Format, Options, export
from turnlight.export.images import png
from turnlight.export.metalness import to_base_colour
from turnlight.export.subject import open_subject

SIDED = Options(side_mm=100.0)
NODE_MODULES = Path(__file__).parents[3] / ".venv/lib/node_modules"

VALIDATE = """
const fs = require("fs");
require("gltf-validator").validateBytes(new Uint8Array(fs.readFileSync(process.argv[1])))
  .then((report) => console.log(JSON.stringify(report.issues)));
"""


def close(ours: Maps, theirs: Maps, tolerance: float, albedo_tolerance: float) -> None:
    """Albedos are compared as coded: square roots."""
    np.testing.assert_allclose(ours.normal, theirs.normal, atol=tolerance)
    np.testing.assert_allclose(ours.roughness, theirs.roughness, atol=albedo_tolerance)
    for a, b in ((ours.diffuse, theirs.diffuse), (ours.specular, theirs.specular)):
        np.testing.assert_allclose(np.sqrt(a), np.sqrt(b), atol=albedo_tolerance)


def test_gltf_comes_back(folder: Path, maps: Maps) -> None:
    document, back = reading.glb(export(folder, Format.GLTF, SIDED).path.read_bytes())
    close(back, maps, 1e-4, 1.5 / 255)
    [corner] = [a for a in document["accessors"] if "max" in a]
    np.testing.assert_allclose(corner["max"], [0.05, 0.05, 0])


def test_materialx_comes_back(folder: Path, maps: Maps) -> None:
    path = export(folder, Format.MATERIALX, SIDED).path
    clipped = Maps(maps.normal, maps.diffuse, maps.roughness, np.minimum(maps.specular, 0.999))
    close(reading.materialx(path), clipped, 1e-4, 2e-3)
    header = reading.exr_header(path / "textures/base_color.exr")
    assert header["xDensity"] == pytest.approx(96 / (100 / 25.4), rel=1e-5)


def test_folder_comes_back(folder: Path, maps: Maps) -> None:
    path = export(folder, Format.FOLDER, SIDED).path
    close(materials.load(path / "png"), maps, 1e-4, 1e-3)
    for name in ("normal", "diffuse", "roughness", "specular"):
        half = reading.exr(path / f"exr/{name}.exr")
        np.testing.assert_allclose(half, getattr(maps, name), rtol=2**-10, atol=4e-5)


def test_base_colour_is_labelled_lossy_and_says_what_it_loses(folder: Path, maps: Maps) -> None:
    path = export(folder, Format.FOLDER, SIDED).path
    told = json.loads((path / "provenance.json").read_text())["basecolor_metalness_lossy"]
    back = materials.load(path / "basecolor_metalness_lossy")
    lost = np.sqrt(np.mean((back.specular - maps.specular) ** 2))
    assert told["specular_rmse"] == pytest.approx(lost, abs=1e-3)
    assert lost < 0.1


def test_base_colour_is_exact_for_what_came_from_it() -> None:
    random = np.random.default_rng(0)
    base = random.uniform(0.05, 0.95, (64, 64, 3)).astype(np.float32)
    metal = random.choice([0.0, 0.3, 1.0], (64, 64, 1)).astype(np.float32)
    flat = np.broadcast_to(np.float32([0, 0, 1]), base.shape)
    maps = Maps(flat, base * (1 - metal), metal, 0.04 * (1 - metal) + base * metal)
    converted = to_base_colour(maps)
    np.testing.assert_allclose(converted.metalness, metal, atol=1e-4)
    np.testing.assert_allclose(converted.base, base, atol=1e-3)


@pytest.mark.parametrize("options", [SIDED, Options(tileable=True, size_px=256, side_mm=30.0)])
def test_the_khronos_validator_finds_nothing(folder: Path, options: Options) -> None:
    node = shutil.which("node") or shutil.which("nodejs")
    assert node, "node is not installed; .ci/debian-packages installs it, and make test runs that"
    assert (NODE_MODULES / "gltf-validator").is_dir(), "make test installs gltf-validator"
    path = export(folder, Format.GLTF, options).path
    environment = {**os.environ, "NODE_PATH": str(NODE_MODULES)}
    command = [node, "-e", VALIDATE, str(path)]
    told = subprocess.run(command, env=environment, capture_output=True, check=True, text=True)
    issues = json.loads(told.stdout)
    assert (issues["numErrors"], issues["numWarnings"]) == (0, 0), issues["messages"]


@pytest.mark.parametrize("height", [False, True])
def test_the_materialx_library_finds_nothing(folder: Path, height: bool) -> None:
    path = export(folder, Format.MATERIALX, Options(height=height, side_mm=100.0)).path
    library = MaterialX.createDocument()
    search = MaterialX.getDefaultDataSearchPath()
    MaterialX.loadLibraries(MaterialX.getDefaultDataLibraryFolders(), search, library)
    document = MaterialX.createDocument()
    MaterialX.readFromXmlFile(document, str(path / "material.mtlx"))
    document.setDataLibrary(library)
    assert document.validate() == (True, "")
    for node in document.traverseTree():
        if node.isA(MaterialX.Node):
            assert node.getNodeDef() is not None, node.getName()
        if node.isA(MaterialX.Input) and node.getType() == "filename":
            assert (path / node.getValueString()).exists()


@pytest.mark.parametrize("kind", list(Format))
def test_every_export_says_where_it_comes_from(folder: Path, kind: Format) -> None:
    origin = {
        "sample": "slate 7",
        "versions": {"turnlight": "0.1.0"},
        "model_sha256": {"edge.json": "11" * 32},
        "photos": [{"file": "a.jpg", "sha256": "22" * 32}],
    }
    (folder / "origin.json").write_text(json.dumps(origin))
    path = export(folder, kind, SIDED).path
    files = [path] if path.is_file() else [p for p in path.rglob("*") if p.is_file()]
    for file in files:
        if file.suffix in (".glb", ".html", ".json") or file.parent.name in ("png", "exr"):
            data = file.read_bytes()
            for word in ("slate 7", "22" * 32, "11" * 32, "OpenGL", '"side_mm"', "Turnlight"):
                found = word.encode() in data or word.replace('"', '\\"').encode() in data
                assert found, (file, word)


def test_png_knows_its_size(folder: Path) -> None:
    path = export(folder, Format.FOLDER, Options(side_mm=48.0)).path
    data = (path / "png/normal.png").read_bytes()
    at = data.index(b"pHYs") + 4
    per_metre = int.from_bytes(data[at : at + 4], "big")
    assert 96 / per_metre == pytest.approx(0.048, rel=1e-3)


def test_nothing_is_overwritten(folder: Path, tmp_path: Path) -> None:
    for kind in (Format.GLTF, Format.FOLDER):
        export(folder, kind, SIDED, tmp_path / kind)
        with pytest.raises((ExportError, SessionError), match="--out"):
            export(folder, kind, SIDED, tmp_path / kind)


def test_bad_input_gets_a_sentence(folder: Path, tmp_path: Path) -> None:
    def said(*arguments: object) -> str:
        result = CliRunner().invoke(cli.commands, ["export", *map(str, arguments)])
        assert result.exit_code == 1, result.output
        assert result.stderr.count("\n") == 1
        return result.stderr

    assert "no folder" in said(tmp_path / "nowhere", "--format", "gltf")
    assert "--side-mm" in said(folder, "--format", "gltf")
    assert "--side-mm" in said(folder, "--format", "folder", "--height")
    assert "holds no height" in said(folder, "--format", "gltf", "--height", "--side-mm", 10)
    assert "--size" in said(folder, "--format", "folder", "--size", 100_000)
    assert "not a material" in said(tmp_path, "--format", "folder")
    blocked = folder / "normal.png" / "deeper" / "a.glb"
    assert "cannot be made" in said(folder, "--format", "gltf", "--side-mm", 9, "--out", blocked)


def test_json(folder: Path) -> None:
    arguments = ["export", folder, "--format", "folder", "--tileable", "--side-mm", 50, "--json"]
    result = CliRunner().invoke(cli.commands, list(map(str, arguments)))
    told = json.loads(result.stdout)
    assert Path(told["path"]).is_dir()
    assert told["seam"]["edge"] <= 1.1
    assert told["size_mm"][0] / told["size_px"][0] == pytest.approx(50 / 96)


def test_what_infer_made_knows_its_photos(tmp_path: Path) -> None:
    photo = tmp_path / "photo.png"
    photo.write_bytes(png(np.random.default_rng(0).random((64, 64, 3), np.float32), 8))
    out = tmp_path / "inferred"
    arguments = ["infer", "--aligned", photo, photo, "--out", out]
    assert CliRunner().invoke(cli.commands, list(map(str, arguments))).exit_code == 0
    known = open_subject(out).provenance
    assert {p.sha256 for p in known.photos} == {hashlib.sha256(photo.read_bytes()).hexdigest()}
    assert known.versions["turnlight"]
    assert known.model_sha256
