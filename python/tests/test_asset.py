"""Meshes with baked textures."""

import inspect
import json
import os
import shutil
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from conftest import program
from PIL import Image

import rtfmesh
from rtfmesh import asset
from rtfmesh.asset._frames import in_tangent_space, tangents, unit
from rtfmesh.asset._pictures import Picture, png, to_linear, to_srgb
from rtfmesh.asset._source import Material, Source

# Mean error of colours that a viewer is allowed to see, of 255.
SEEN = 4.0


def ball(count=4000, bumps=0.0):
    """A sphere of radius 1, with bumps as high as this."""
    mesh = rtfmesh.remesh(rtfmesh.sample("bumpy-sphere"), count, correspondence=False)
    at = unit(mesh.vertices)
    return at * (1.0 + bumps * np.sin(12.0 * at).prod(axis=1, keepdims=True)), mesh.faces


def shade(at):
    """A colour in sRGB, 0 to 1, for each direction."""
    return 0.5 + 0.5 * np.sin(4.0 * unit(at) + np.array([0.0, 1.0, 2.0]))


def on_sphere(corners):
    """Texture coordinates of a sphere's faces by longitude and latitude, without jumps inside a face."""
    turn = np.arctan2(corners[..., 1], corners[..., 0]) / (2.0 * np.pi) % 1.0
    turn -= np.round(turn - turn[:, :1])
    rise = np.arcsin(np.clip(corners[..., 2], -1.0, 1.0)) / np.pi + 0.5
    return np.stack([turn, rise], axis=2)


def picture(made, name):
    return np.asarray(Image.open(BytesIO(made.pictures[name])).convert("RGB")) / 255.0


def places(made, count=20_000):
    """Places all over an asset: faces, weights, positions, texture coordinates with v downwards."""
    random = np.random.default_rng(1)
    corners = made.vertices[made.faces]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    face = random.choice(len(area), count, p=area / area.sum())
    weights = random.dirichlet([1.0, 1.0, 1.0], count)
    at = np.einsum("nk,nkc->nc", weights, corners[face])
    uv = np.einsum("nk,nkc->nc", weights, made.uv[face])
    return face, weights, at, np.column_stack([uv[:, 0], 1.0 - uv[:, 1]])


def seen(made, name, uv):
    """What a viewer sees of a picture, without levels."""
    found = Picture.decode(made.pictures[name], False)
    return found.at(uv, np.zeros(len(uv), np.int64), (33071, 33071))[:, :3]


def test_colours_of_vertices_are_baked():
    vertices, faces = ball()
    colours = np.round(shade(vertices) * 255.0).astype(np.uint8)
    mesh = rtfmesh.Mesh(vertices, faces, rtfmesh.Attributes(vertex={"rgb": colours}))
    made = asset.make(mesh, 600, texture=256)
    assert (len(made.faces), set(made.pictures)) == (600, {"colour", "normal"})
    _, _, at, uv = places(made)
    assert np.abs(seen(made, "colour", uv) - shade(at)).mean() * 255.0 < SEEN
    assert 0.3 < made.covered <= 1.0 and made.charts >= 2


def test_pictures_of_materials_are_baked(tmp_path):
    vertices, faces = ball()
    uv = on_sphere(vertices[faces])
    row, column = np.mgrid[0:256, 0:512]
    turn, rise = (column + 0.5) / 512 * 2.0 * np.pi, (0.5 - (row + 0.5) / 256) * np.pi
    at = np.stack([np.cos(turn) * np.cos(rise), np.sin(turn) * np.cos(rise), np.sin(rise)], axis=2)
    colour = png(shade(at.reshape(-1, 3)).reshape(at.shape))
    surface = png(np.stack([np.ones_like(rise), 0.25 + 0.5 * (rise > 0), np.zeros_like(rise)], axis=2))
    materials = rtfmesh._native.Materials.textured((colour, surface, None, None), (0, 1), "opaque", True)
    source = rtfmesh.Attributes(
        face={"material": np.zeros(len(faces), np.uint32)},
        uv=uv,
        label_names={"material": ["painted"]},
        materials=materials,
    )
    rtfmesh.write(tmp_path / "painted.glb", vertices, faces, attributes=source)
    made = asset.make(tmp_path / "painted.glb", "1k", texture=512, normals=False)
    assert (len(made.faces), set(made.pictures)) == (1000, {"colour", "surface"})
    _, _, at, uv = places(made)
    # Not where the texture coordinates of the source jump, since pictures that we write do not repeat.
    fair = (np.abs(at[:, 1]) > 0.1) | (at[:, 0] < 0)
    error = np.abs(seen(made, "colour", uv) - shade(at)).mean(axis=1)
    assert error[fair & (np.abs(at[:, 2]) < 0.95)].mean() * 255.0 < SEEN
    roughness = seen(made, "surface", uv)[:, 1]
    upper = at[:, 2] > 0.1
    assert np.abs(roughness[upper] - 0.75).mean() < 0.02 and roughness[at[:, 2] < -0.1].mean() < 0.27

    out = tmp_path / "out.glb"
    made.write(out)
    if "RTFMESH_GLTF" in os.environ:
        shutil.copy(out, Path(os.environ["RTFMESH_GLTF"]) / "asset.glb")
    again = rtfmesh.read(out, materials=True)
    assert len(again.faces) == 1000 and np.allclose(again.attributes.uv, made.uv, atol=1e-6)
    [material] = json.loads(again.attributes.materials.json())["materials"]
    assert material["doubleSided"] is True
    assert again.attributes.materials.images() == [made.pictures["colour"], made.pictures["surface"]]


def test_baked_normals_show_what_is_finer_than_the_triangles():
    vertices, faces = ball(20_000, bumps=0.05)
    made = asset.make((vertices, faces), 1500, texture=512)
    face, weights, at, uv = places(made)
    normal = unit(np.einsum("nk,nkc->nc", weights, made.normals[made.faces[face]]))
    tangent, side = tangents(made.vertices, made.faces, made.uv, made.normals)
    along = unit(np.einsum("nk,nkc->nc", weights, tangent[face]))
    x, y, z = (seen(made, "normal", uv) * 2.0 - 1.0).T
    shown = unit(
        x[:, None] * along + y[:, None] * np.cross(normal, along) * side[face][:, None] + z[:, None] * normal
    )
    under = rtfmesh.locate((vertices, faces), at, normal, margin=0.05)
    source = Source.of(vertices, faces, rtfmesh.Attributes(), False)
    true = source.look(under.triangles, under.barycentrics, np.zeros(len(at))).normal

    def degrees(found):
        return np.degrees(np.arccos(np.clip((found * true).sum(axis=1), -1.0, 1.0)))

    before, after = degrees(normal).mean(), degrees(shown).mean()
    assert after < 2.0 and after < 0.4 * before, (before, after)


def test_vectors_in_tangent_space_come_back():
    random = np.random.default_rng(2)
    normal, tangent, own = (unit(random.normal(size=(50, 3))) for _ in range(3))
    side = np.where(random.random(50) < 0.5, -1.0, 1.0)
    x, y, z = in_tangent_space(own, normal, tangent, side).T[:, :, None]
    third = np.cross(normal, tangent) * side[:, None]
    assert np.allclose(x * tangent + y * third + z * normal, own)


def test_broken_meshes_are_wrapped_and_keep_their_colours():
    vertices, faces = ball()
    # An upper half, turned over, and a lower one, a little smaller.
    upper = vertices[faces].mean(axis=1)[:, 2] > 0
    both = np.concatenate([faces[upper][:, ::-1], faces[~upper] + len(vertices)])
    soup = np.concatenate([vertices, 0.99 * vertices])
    mesh = rtfmesh.Mesh(soup, both, rtfmesh.Attributes(vertex={"rgb": shade(soup)}))
    made = asset.make(mesh, 1000, texture=256, wrap="4%", normals=False)
    assert made.report["output"]["topology"]["boundary_loops"] == 0
    _, _, at, uv = places(made)
    assert np.abs(seen(made, "colour", uv) - shade(at)).mean() * 255.0 < 2.0 * SEEN


def test_opacity_is_that_of_each_material():
    vertices, faces = ball(300)
    half = (vertices[faces].mean(axis=1)[:, 2] > 0).astype(np.uint32)
    source = Source.of(vertices, faces, rtfmesh.Attributes(face={"material": half}), False)
    source.of_face = half.astype(np.int64)
    weights = np.full((len(faces), 3), 1.0 / 3.0)
    for alpha, opacity, seen_as in [
        ("opaque", 0.3, 1.0),
        ("mask", 0.3, 0.0),
        ("mask", 0.6, 1.0),
        ("blend", 0.3, 0.3),
    ]:
        other = Material(np.array([1.0, 1.0, 1.0, 0.5], np.float32), alpha="blend")
        own = Material(np.array([1.0, 1.0, 1.0, opacity], np.float32), alpha=alpha)
        source.materials = [other, own]
        look = source.look(np.arange(len(faces)), weights, np.ones(len(faces)))
        assert np.allclose(look.colour[:, 3], np.where(half == 1, seen_as, 0.5)), alpha


def test_pictures_of_all_kinds_are_decoded():
    ramp = np.linspace(0, 65535, 64).reshape(8, 8)
    made = {
        "16 bits": Image.fromarray(ramp.astype(np.uint16)),
        "grey": Image.fromarray((ramp / 257).astype(np.uint8)),
        "palette": Image.fromarray((ramp / 257).astype(np.uint8)).convert("P"),
    }
    for name, image in made.items():
        out = BytesIO()
        image.save(out, "PNG")
        found = Picture.decode(out.getvalue(), False).levels[0][..., 0]
        assert np.abs(found - ramp / 257).max() <= 1.0, name
    with pytest.raises(rtfmesh.InputError, match="a picture cannot be read"):
        Picture.decode(b"no picture", False)


@pytest.mark.parametrize("scale", [1e-160, 1e150])
def test_any_unit_will_do(scale):
    vertices, faces = rtfmesh.sample("torus")
    made = asset.make((vertices * scale, faces), 2000, texture=64)
    assert (len(made.faces), made.covered > 0.3) == (2000, True)


@pytest.mark.parametrize(
    ("colours", "largest"),
    [(np.uint8, 255), (np.uint16, 65535), (np.int32, 255), (np.float32, 1), (np.float64, 255)],
)
def test_colours_of_all_types_are_baked(colours, largest):
    vertices, faces = ball(400)
    values = (shade(vertices) * largest).astype(colours)
    made = asset.make((vertices, faces), 300, texture=64, attributes={"vertex": {"rgb": values}})
    _, _, at, uv = places(made, 2000)
    assert np.abs(seen(made, "colour", uv) - shade(at)).mean() * 255.0 < 3.0 * SEEN


def test_light_and_srgb_are_inverse():
    values = np.linspace(0.0, 1.0, 256)
    assert np.allclose(to_srgb(to_linear(values)), values, atol=1e-6)


def test_places_of_points():
    vertices, faces = rtfmesh.sample("torus")
    found = rtfmesh.locate((vertices, faces), vertices[5:9] * 1.0001)
    assert np.allclose(found.interpolate(faces, vertices), vertices[5:9], atol=1e-3)
    with pytest.raises(rtfmesh.InputError, match="`points` has a value in row 1 that is not finite"):
        rtfmesh.locate((vertices, faces), [[0, 0, 0], [np.nan, 0, 0]])
    with pytest.raises(rtfmesh.InputError, match="`normals` has shape"):
        rtfmesh.locate((vertices, faces), vertices[:2], vertices[:3])
    with pytest.raises(rtfmesh.InputError, match="`margin` is -1"):
        rtfmesh.locate((vertices, faces), vertices[:2], margin=-1)


@pytest.mark.parametrize(
    ("keywords", "says"),
    [
        ({"texture": 4}, "`texture` 4 is out of range; use 16 to 8192"),
        ({"texture": "2k"}, "`texture` is '2k'; give a whole number"),
        ({"normals": 1}, "`normals` is 1; use True or False"),
        ({"keep_uv": True}, "`keep_uv` is not for assets; leave it out"),
        ({"cells": True}, "`cells` is not for assets; leave it out"),
        ({"n": 500}, "`n` is not for assets; `faces` says how many triangles"),
        ({"edge_length": "5%"}, "`edge_length` is not for assets; `faces` says"),
        ({"device": 1.5}, "`device` is 1.5; give"),
        ({"distances": "yes"}, "`distances` is 'yes'; use True or False"),
        ({"faces": "many"}, "`faces` is 'many'; give a whole number"),
        ({"faces": 2}, "`faces` 2 is out of range; ask for at least 4 triangles"),
        ({"told": 3}, "`told` is 3; give a function"),
        ({"attributes": {"vertex": {"rgb": [[1, 2, 3]]}}}, "`attributes.vertex\\['rgb'\\]` has shape"),
        ({"attributes": {"uv": [[[0.0, 0.0]]]}}, "`attributes.uv` has shape"),
    ],
)
def test_wrong_calls_are_told(keywords, says):
    with pytest.raises(rtfmesh.InputError, match=says):
        asset.make(rtfmesh.sample("torus"), **keywords)


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [
        ("face", "faces"),
        ("n_face", "faces"),
        ("texture_size", "texture"),
        ("normal", "normals"),
        ("linear_colors", "linear_colours"),
        ("feature_angel", "feature_angle"),
        ("fill_hole", "fill_holes"),
        ("devise", "device"),
        ("progress_bar", "progress"),
        ("target_faces", "faces"),
    ],
)
def test_near_names_are_suggested(wrong, meant):
    with pytest.raises(TypeError) as raised:
        asset.make("no such file.glb", **{wrong: 5})
    says = f"make() got an unexpected keyword argument '{wrong}'; did you mean '{meant}'?"
    assert str(raised.value) == says


def test_the_signature_has_what_works():
    parameters = inspect.signature(asset.make).parameters
    assert {"faces", "texture", "wrap", "device", "progress", "quality"} < set(parameters)
    assert not {"n", "n_faces", "keep_uv", "edge_length", "options"} & set(parameters)
    text = inspect.getdoc(asset.make)
    assert "\nwrap : float | str" in text and "\nkeep_uv : " not in text
    with pytest.raises(TypeError, match=r"'zzz'$"):
        asset.make("no such file.glb", zzz=1)
    with pytest.raises(TypeError, match=r"^make\(\) .*'preset'; did you mean research=\{'preset': 'rtf'\}"):
        asset.make("no such file.glb", preset="rtf")


def test_meshes_that_cannot_be_are_named():
    box = rtfmesh.sample("box")
    with pytest.raises(rtfmesh.InputError, match=r"^`mesh` is of type ndarray, .*; give the name of a file,"):
        asset.make(box.vertices)
    with pytest.raises(rtfmesh.InputError, match=r"^`mesh\.vertices` has shape"):
        asset.make((box.vertices[:, :2], box.faces))
    with pytest.raises(rtfmesh.InputError, match=r"^`faces`"):
        asset.make(box, 10**12)


def test_the_remeshing_is_done_as_asked():
    told = []
    made = asset.make(
        rtfmesh.sample("torus"), 800, texture=64, told=told.append, distances=True, device="cpu", seed=7
    )
    assert made.report["output"]["distances"]["rms"] > 0 and made.report["options"]["seed"] == 7
    assert told == ["remeshing", "cutting into charts", "baking"]


def test_the_command(tmp_path, folder):
    done = program(
        "asset", folder / "torus.ply", tmp_path / "torus.glb", "--faces", "500", "--texture", "64",
        "--report", tmp_path / "report.json",
    )  # fmt: skip
    assert done.returncode == 0 and "500 triangles" in done.stderr, done.stderr
    assert json.loads((tmp_path / "report.json").read_text())["faces"] == 500
    assert len(rtfmesh.read(tmp_path / "torus.glb").faces) == 500


def test_names_of_files_do_not_control_the_terminal(folder):
    done = program("asset", "torus.ply", "red\x1b[31m.glb", "--faces", "500", "--texture", "64", cwd=folder)
    assert done.returncode == 0 and "\x1b" not in done.stderr and "red\\x1b[31m.glb" in done.stderr


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (["missing.ply", "out.glb"], 3, "error: missing.ply"),
        (["torus.ply", "out.obj"], 2, "error: 'out.obj' is no .glb file"),
        (["torus.ply", "out.glb", "--texture", "5"], 2, "error: --texture 5 is out of range"),
        (["torus.ply", "out.glb", "--faces", "many"], 2, "error: "),
        (["torus.ply", "out.glb", "--faces", "1"], 2, "error: --faces 1 is out of range"),
        (["torus.ply", "nowhere/out.glb"], 1, "error: nowhere/out.glb: there is no such folder"),
        (["torus.ply", "out.glb", "--report", "nowhere/r.json"], 1, "there is no such folder"),
    ],
)
def test_wrong_commands_are_told(words, code, says, folder):
    done = program("asset", *words, cwd=folder)
    assert done.returncode == code and says in done.stderr, done.stderr
    assert "Traceback" not in done.stderr and not (folder / "out.glb").exists()
