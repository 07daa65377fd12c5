"""Files, with what they hold besides the shape."""

import numpy as np
import pytest

import rtfmesh


def test_meshes_are_the_same_after_writing_and_reading(torus, tmp_path):
    for name in ("a.ply", "a.obj", "a.off", "a.mesh", "a.ply.gz"):
        rtfmesh.write(tmp_path / name, torus.vertices, torus.faces)
        again = rtfmesh.read(str(tmp_path / name))
        # OBJ files are read in the order in which faces use vertices.
        assert np.array_equal(again.vertices[again.faces], torus.vertices[torus.faces]), name
        assert again.notes == []
    assert repr(again) == f"<rtfmesh.Mesh: {len(torus.vertices)} vertices, {len(torus.faces)} faces>"


def test_attributes_are_the_same_after_writing_and_reading(torus, tmp_path):
    count, faces = len(torus.vertices), len(torus.faces)
    attributes = rtfmesh.Attributes(
        vertex={
            "colour": np.arange(3 * count).reshape(-1, 3).astype(np.uint8),
            "weight": np.linspace(0, 1, count, dtype=np.float32),
        },
        face={"label": np.arange(faces, dtype=np.int32)},
        uv=np.random.default_rng(1).random((faces, 3, 2)).astype(np.float32),
    )
    path = tmp_path / "a.ply"
    rtfmesh.write(path, torus.vertices, torus.faces, attributes=attributes)
    again = rtfmesh.read(path).attributes
    for own, theirs in ((attributes.vertex, again.vertex), (attributes.face, again.face)):
        assert own.keys() == theirs.keys()
        assert all(np.array_equal(own[name], theirs[name]) for name in own)
        assert all(own[name].dtype == theirs[name].dtype for name in own)
    assert np.array_equal(again.uv, attributes.uv)


def test_attributes_go_from_file_to_file(torus, tmp_path):
    colours = np.where(torus.vertices[:, :1] > 0, [[255, 0, 0]], [[0, 0, 255]]).astype(np.uint8)
    labels = {"halves": (torus.vertices[torus.faces].mean(axis=1)[:, 1] > 0).astype(np.int64)}
    given = {"vertex": {"rgb": colours}, "face": labels}
    rtfmesh.write(tmp_path / "a.ply", torus.vertices, torus.faces, attributes=given)
    mesh = rtfmesh.read(tmp_path / "a.ply")
    assert mesh.attributes.face["halves"].dtype == np.int32
    result = rtfmesh.remesh(mesh.vertices, mesh.faces, 300, attributes=mesh.attributes)
    rtfmesh.write(tmp_path / "b.ply", result.vertices, result.faces, attributes=result.attributes)
    again = rtfmesh.read(tmp_path / "b.ply")
    right = again.vertices[:, 0] > 0.3
    assert (again.attributes.vertex["colour"][right] == [255, 0, 0]).all()
    assert len(result.face_correspondence.triangles) == len(result.faces)
    expected = mesh.attributes.face["halves"][result.face_correspondence.triangles]
    assert np.array_equal(again.attributes.face["halves"], expected)


def test_labels_keep_their_names(torus, tmp_path):
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in torus.vertices.tolist())
    faces = [f"f {a} {b} {c}\n" for a, b, c in (torus.faces + 1).tolist()]
    half = len(faces) // 2
    text = vertices + "g first\n" + "".join(faces[:half]) + "g second\n" + "".join(faces[half:])
    (tmp_path / "a.obj").write_text(text)
    mesh = rtfmesh.read(tmp_path / "a.obj")
    assert mesh.attributes.label_names == {"group": ["first", "second"]}
    result = rtfmesh.remesh(mesh.vertices, mesh.faces, 300, attributes=mesh.attributes, keep_labels=True)
    rtfmesh.write(tmp_path / "b.obj", result.vertices, result.faces, attributes=result.attributes)
    assert "g first\n" in (tmp_path / "b.obj").read_text()


@pytest.mark.parametrize("of", [np.int32, np.int64, bool, str, object])
def test_borders_of_labels_stay_whatever_their_type(torus, remesher, of):
    halves = (torus.vertices[torus.faces].mean(axis=1)[:, 1] > 0).astype(of)
    attributes = {"face": {"half": halves}}
    result = remesher.remesh(torus.vertices, torus.faces, 400, attributes=attributes, keep_labels=True)
    kept = result.attributes.face["half"]
    assert kept.dtype == halves.dtype and set(kept) == set(halves)
    # A face across the border would have corners on both sides.
    sides = result.vertices[result.faces][:, :, 1]
    over = (sides > 0.02).any(axis=1) & (sides < -0.02).any(axis=1)
    assert over.mean() < 0.02


def test_what_a_format_cannot_hold_is_a_warning(torus, tmp_path):
    far = torus.vertices + 1e7
    with pytest.warns(rtfmesh.MeshWarning, match=r"a\.stl"):
        rtfmesh.write(tmp_path / "a.stl", far, torus.faces)
    with pytest.warns(rtfmesh.MeshWarning, match="cannot hold"):
        weights = {"vertex": {"weight": np.ones(len(far))}}
        rtfmesh.write(tmp_path / "a.off", far, torus.faces, attributes=weights)


def test_files_that_cannot_be_are_errors(torus, tmp_path):
    with pytest.raises(rtfmesh.InputError, match=r"missing\.ply"):
        rtfmesh.read(tmp_path / "missing.ply")
    (tmp_path / "bad.ply").write_text("ply\nformat ascii 1.0\nelement vertex 3\n")
    with pytest.raises(rtfmesh.InputError, match=r"bad\.ply"):
        rtfmesh.read(tmp_path / "bad.ply")
    with pytest.raises(rtfmesh.InputError, match=r"^`path` .*a\.xyz"):
        rtfmesh.write(tmp_path / "a.xyz", torus.vertices, torus.faces)
    with pytest.raises(rtfmesh.OutputError) as raised:
        rtfmesh.write(tmp_path / "no" / "a.ply", torus.vertices, torus.faces)
    assert isinstance(raised.value, OSError)
    with pytest.raises(rtfmesh.InputError, match="pdf"):
        rtfmesh.write(tmp_path / "a", torus.vertices, torus.faces, format="pdf")
    with pytest.raises(rtfmesh.InputError, match="which no file holds"):
        words = {"vertex": {"word": np.array(["a"] * len(torus.vertices))}}
        rtfmesh.write(tmp_path / "a.ply", torus.vertices, torus.faces, attributes=words)
    assert list(tmp_path.glob("a*")) == []
