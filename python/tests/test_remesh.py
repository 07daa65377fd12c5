"""Runs: counts, types of arrays, options, correspondence."""

import json

import make_options
import numpy as np
import pytest
from conftest import program, same

import rtfmesh
from rtfmesh import _words


def test_the_result_has_as_many_vertices_as_asked_for(torus):
    result = rtfmesh.remesh(torus.vertices, torus.faces, 300)
    assert result.vertices.shape == (300, 3) and result.vertices.dtype == np.float64
    assert result.faces.shape == (600, 3) and result.faces.dtype == np.uint32
    assert sorted(np.unique(result.faces)) == list(range(300))
    assert result.report["output"]["vertices"] == 300
    assert repr(result).startswith("<rtfmesh.Result: 300 vertices, 600 faces, quality 0.")


def test_results_are_not_copied(torus, remesher):
    result = remesher.remesh(torus.vertices, torus.faces, 300)
    for array in (result.vertices, result.faces):
        # A view of memory that is Rust's own.
        assert not array.flags.owndata and array.flags.c_contiguous and array.flags.writeable
        assert type(array.base.base).__name__ == "PySliceContainer"


@pytest.mark.parametrize(
    "make",
    [
        pytest.param(lambda v, f: (v, f.astype(np.int32)), id="int32"),
        pytest.param(lambda v, f: (v, f.astype(np.int64)), id="int64"),
        pytest.param(lambda v, f: (v, f.astype(np.uint64)), id="uint64"),
        pytest.param(lambda v, f: (v, f.astype(np.int16)), id="int16"),
        pytest.param(lambda v, f: (np.asfortranarray(v), np.asfortranarray(f)), id="columns"),
        pytest.param(
            lambda v, f: (np.repeat(v, 2, axis=0)[::2], np.repeat(f, 3, axis=1)[:, ::3]), id="strided"
        ),
        pytest.param(lambda v, f: (v[::-1], len(v) - 1 - f.astype(int))[:2], id="reversed"),
        pytest.param(lambda v, f: (v.astype(">f8"), f.astype(">i4")), id="big-endian"),
        pytest.param(lambda v, f: (v.tolist(), f.tolist()), id="lists"),
        pytest.param(lambda v, f: (np.ma.masked_array(v), tuple(map(tuple, f))), id="masked"),
    ],
)
def test_any_type_and_stride_gives_the_same(torus, remesher, make):
    vertices, faces = make(torus.vertices, torus.faces)
    result = remesher.remesh(vertices, faces, 200)
    if isinstance(vertices, np.ndarray) and not np.array_equal(vertices, torus.vertices):
        # The same surface in another order of vertices.
        assert result.vertices.shape == (200, 3)
    else:
        assert same(result, remesher.remesh(torus.vertices, torus.faces, 200))


def test_float32_and_integers_are_positions_too(torus, remesher, tetrahedron):
    single = torus.vertices.astype(np.float32)
    result = remesher.remesh(single, torus.faces, 200)
    assert same(result, remesher.remesh(single.astype(np.float64), torus.faces, 200))
    assert len(remesher.remesh(*tetrahedron, 50).vertices) == 50


@pytest.mark.parametrize("n", [200, 200.0, np.int32(200), np.float64(200), "200", "0.2k"])
def test_counts_may_be_written_in_many_ways(torus, remesher, n):
    assert len(remesher.remesh(torus.vertices, torus.faces, n).vertices) == 200


def test_lengths_and_ratios_stand_for_counts(torus, remesher):
    by_ratio = remesher.remesh(torus.vertices, torus.faces, ratio=0.1)
    assert len(by_ratio.vertices) == round(0.1 * len(torus.vertices))
    by_length = remesher.remesh(torus.vertices, torus.faces, edge_length="5%")
    sides = by_length.vertices[by_length.faces] - by_length.vertices[np.roll(by_length.faces, 1, axis=1)]
    diagonal = np.linalg.norm(np.ptp(torus.vertices, axis=0))
    assert np.linalg.norm(sides, axis=2).mean() == pytest.approx(0.05 * diagonal, rel=0.1)
    by_deviation = remesher.remesh(torus.vertices, torus.faces, max_deviation="2%")
    assert by_deviation.report["deviation"]["is_reached"]
    stretched = remesher.remesh(torus.vertices, torus.faces, 300, sizing="anisotropic", aspect=3)
    assert len(stretched.vertices) == 300
    assert 1.1 < stretched.report["metric"]["mean_aspect"] < 3
    assert by_deviation.report["metric"] is None
    same_count = remesher.remesh(torus.vertices, torus.faces, quality="draft")
    assert len(same_count.vertices) == len(torus.vertices)


def test_the_program_gives_the_same_bytes(folder, sphere, tmp_path):
    options = ["--quality", "draft", "--seed", "7", "--sizing", "curvature", "--max-edge", "20%", "--no-fit"]
    report, out, ours = tmp_path / "r.json", tmp_path / "a.ply", tmp_path / "b.ply"
    line = ["remesh", folder / "bumpy-sphere.ply", out, "-n", "500", "--report", report, *options]
    done = program(*line)
    assert done.returncode == 0, done.stderr
    result = rtfmesh.remesh(
        sphere.vertices,
        sphere.faces,
        500,
        distances=True,
        correspondence=False,
        quality="draft",
        seed=7,
        sizing="curvature",
        max_edge="20%",
        fit=False,
    )
    rtfmesh.write(ours, result.vertices, result.faces)
    assert ours.read_bytes() == out.read_bytes()
    theirs = json.loads(report.read_text())
    assert set(theirs) - set(result.report) == {"input_file", "output_file"}
    for key in ("output", "input", "features", "warnings", "steps", "device"):
        assert result.report[key] == theirs[key], key
    theirs["options"].pop("format"), result.report["options"].pop("format")
    assert result.report["options"] == theirs["options"]
    assert result.report["timings"]["stages"][0]["milliseconds"] is not None


def test_vertices_correspond_to_points_of_the_input(torus, remesher):
    result = remesher.remesh(torus.vertices, torus.faces, 1000, fit=False)
    found = result.correspondence
    assert found.triangles.shape == (1000,) and found.barycentrics.shape == (1000, 3)
    assert (found.barycentrics >= 0).all() and np.allclose(found.barycentrics.sum(axis=1), 1)
    # Without the fit vertices stay on the input, within the rounding of the device's numbers.
    places = found.interpolate(torus.faces, torus.vertices)
    assert np.abs(places - result.vertices).max() < 1e-5
    heights = found.interpolate(torus.faces, torus.vertices[:, 2])
    assert heights.shape == (1000,) and np.allclose(heights, places[:, 2])
    assert result.face_correspondence is None
    without = remesher.remesh(torus.vertices, torus.faces, 1000, correspondence=False)
    assert without.correspondence is None


def test_an_array_of_sizes_makes_edges_shorter_where_it_is_small(torus, remesher):
    sizes = np.where(torus.vertices[:, 0] > 0, 1.0, 3.0)
    result = remesher.remesh(torus.vertices, torus.faces, 1000, sizing=sizes)
    assert (result.vertices[:, 0] > 0).mean() > 0.7
    assert result.attributes.vertex == {}
    named = remesher.remesh(
        torus.vertices, torus.faces, 1000, sizing="property:size", attributes={"vertex": {"size": sizes}}
    )
    assert same(result, named)


def test_edges_by_their_vertices_are_kept(folder, remesher):
    box = rtfmesh.read(folder / "box.ply")
    sides = np.concatenate([box.faces[:, [0, 1]], box.faces[:, [1, 2]], box.faces[:, [2, 0]]])
    lengths = np.linalg.norm(np.diff(box.vertices[sides], axis=1)[:, 0], axis=1)
    diagonal = sides[lengths.argmax()]
    kept = remesher.remesh(box.vertices, box.faces, 300, features=[diagonal])
    free = remesher.remesh(box.vertices, box.faces, 300, features=np.empty((0, 2), int))
    assert kept.report["features"]["curves"] == free.report["features"]["curves"] + 1
    ends = box.vertices[diagonal]
    distances = np.linalg.norm(kept.vertices[:, None] - ends, axis=2).min(axis=0)
    assert np.allclose(distances, 0, atol=1e-5)


def test_the_report_has_distances_where_they_are_asked_for(torus):
    assert rtfmesh.remesh(torus.vertices, torus.faces, 300).report["output"]["distances"] is None
    distances = rtfmesh.remesh(torus.vertices, torus.faces, 300, distances=True).report["output"]["distances"]
    assert 0 < distances["rms"] < distances["hausdorff"]


def test_one_remesher_takes_many_meshes(torus, sphere, remesher):
    first = remesher.remesh(torus.vertices, torus.faces, 200)
    assert len(remesher.remesh(sphere.vertices, sphere.faces, 500).vertices) == 500
    assert same(first, remesher.remesh(torus.vertices, torus.faces, 200))
    assert remesher.device in rtfmesh.devices()
    assert remesher.device["name"] in repr(remesher)


def test_settings_for_research_are_one_argument(torus, remesher):
    result = remesher.remesh(torus, 1000, research={"preset": "rtf", "k_clip": 24, "normals": "fit"})
    assert result.report["options"]["method"] == "all-at-once"
    normals = np.tile([0.0, 0.0, 1.0], (len(torus.vertices), 1))
    # The same name, for another thing.
    with pytest.raises(rtfmesh.InputError, match=r"`normals` has shape"):
        remesher.reconstruct(torus.vertices, 300, normals=normals[:5], research={"normals": "fit"})


def test_the_list_of_options_is_the_command_lines():
    research = set(_words.RESEARCH)
    assert set(rtfmesh.Research.__annotations__) == research
    assert set(rtfmesh.Options.__annotations__) == (set(_words.flags()) - research) | {"research"}
    assert {"keep_uv", "k_clip", "vertices_at_least", "time_limit", "min_edge"} < set(_words.flags())


def test_the_list_of_options_is_up_to_date():
    with open(rtfmesh._options.__file__, encoding="utf-8") as file:
        assert file.read() == "\n".join(make_options.lines()) + "\n", "run tools/make_options.py"


def test_points_boundaries_regions_and_counts_are_arguments_too(torus, remesher):
    points = torus.vertices[torus.faces[[5, 90, 200]]].mean(axis=1)
    result = remesher.remesh(torus, 600, fixed_points=points)
    there = {tuple(vertex) for vertex in result.vertices}
    assert all(tuple(point) in there for point in points)
    assert len(remesher.remesh(torus, n_faces=1000).faces) == 1000
    regions = ["sphere:1,0,0,0.3=0.08", "box:-2,-2,-2,-0.8,2,2=0.15"]
    finer = remesher.remesh(torus, 1500, refine=regions)
    assert len(finer.vertices) == 1500 and finer.report["options"]["coarse_to_fine"]["refine"]
    with pytest.raises(rtfmesh.InputError, match="`n_faces`"):
        remesher.remesh(torus, n_faces=2)


def test_parts_stay_bit_by_bit(torus, remesher):
    vertices, faces = np.asarray(torus.vertices), np.asarray(torus.faces)
    mask = vertices[faces][:, :, 0].mean(axis=1) < -0.3
    corners = {tuple(map(tuple, vertices[face])) for face in faces[mask]}
    for options in ({"keep": mask}, {"only": np.flatnonzero(~mask)}, {"keep": ["selection:mark"]}):
        attributes = {"face": {"mark": mask.astype(np.uint8)}}
        result = remesher.remesh(vertices, faces, 1500, attributes=attributes, **options)
        assert len(result.vertices) == 1500
        assert corners <= {tuple(map(tuple, result.vertices[face])) for face in result.faces}
    with pytest.raises(rtfmesh.InputError, match="`keep` names a face"):
        remesher.remesh(vertices, faces, 1500, keep=[len(faces)])
    with pytest.raises(rtfmesh.InputError, match="contradict each other"):
        remesher.remesh(vertices, faces, 1500, keep=mask, only=mask)
    with pytest.raises(rtfmesh.InputError, match="needs faces"):
        remesher.reconstruct(vertices, 500, keep=mask)


def test_boundaries_stay_bit_by_bit(remesher):
    grid = np.linspace(0.0, 1.0, 13)
    x, y = (axis.ravel() for axis in np.meshgrid(grid, grid))
    vertices = np.column_stack([x, y, 0.1 * np.sin(5 * x) * y])
    first = (np.arange(12)[:, None] * 13 + np.arange(12)).ravel()
    faces = np.concatenate(
        [
            np.column_stack([first, first + 1, first + 14]),
            np.column_stack([first, first + 14, first + 13]),
        ]
    )
    result = remesher.remesh(vertices, faces, 300, keep_boundary=True)
    there = {tuple(vertex) for vertex in result.vertices}
    border = vertices[(x == 0) | (x == 1) | (y == 0) | (y == 1)]
    assert len(border) == 48 and all(tuple(vertex) in there for vertex in border)


@pytest.mark.parametrize("scale", [1e-30, 1e-9, 1e12, 1e200])
def test_any_unit_will_do(torus, remesher, scale):
    result = remesher.remesh(torus.vertices * scale, torus.faces, 300)
    expected = remesher.remesh(torus, 300)
    assert np.array_equal(result.faces, expected.faces)
    assert np.allclose(result.vertices / scale, expected.vertices, atol=1e-5)


def test_places_far_from_the_origin_keep_their_digits(torus, remesher):
    corner = np.array([500_000.0, 5_000_000.0, 100.0])
    result = remesher.remesh(torus.vertices + corner, torus.faces, 300)
    near = rtfmesh.measure(result.vertices - corner, result.faces, against=torus)
    expected = rtfmesh.measure(remesher.remesh(torus, 300), against=torus)
    for key in ("rms", "hausdorff"):
        assert near["distances"][key] == pytest.approx(expected["distances"][key], rel=0.2)
    assert near["quality"]["mean_quality"] > 0.93


def test_faces_that_look_inward_are_turned(torus, remesher):
    is_even = (np.arange(len(torus.faces)) % 2 == 0)[:, None]
    mixed = np.where(is_even, torus.faces, torus.faces[:, ::-1])
    result = remesher.remesh(torus.vertices, mixed, 300)
    assert result.report["repaired"]["faces_turned"] == len(torus.faces) // 2
    a, b, c = (result.vertices[result.faces[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() > 0
    assert result.report["output"]["topology"]["genus"] == 1


def test_corners_of_a_box_stay_exactly(remesher):
    box = rtfmesh.sample("box")
    there = {tuple(vertex) for vertex in remesher.remesh(box, 500).vertices}
    assert there >= {tuple(vertex) for vertex in box.vertices}


def test_a_deviation_out_of_reach_is_a_warning_with_a_remedy(torus, remesher):
    with pytest.warns(rtfmesh.MeshWarning, match=r"instead of 0\.0100 %: about \d+ vertices would reach it"):
        result = remesher.remesh(torus, 300, max_deviation="0.01%")
    deviation = result.report["deviation"]
    assert len(result.vertices) == 300 and not deviation["is_reached"]
    assert deviation["enough"] > 300 and deviation["reached"] > deviation["asked"]


def test_holes_are_filled_first(remesher):
    vertices, faces = rtfmesh.sample("torus")
    open_faces = faces[~(faces == 100).any(axis=1)]
    result = remesher.remesh(vertices, open_faces, 600, fill_holes="100%", distances=True)
    topology = result.report["output"]["topology"]
    assert (topology["boundary_loops"], topology["genus"], len(result.vertices)) == (0, 1, 600)
    assert result.report["repaired"]["holes_filled"] == 1
    assert result.report["output"]["distances"]["hausdorff"] < 3
    with pytest.raises(rtfmesh.InputError, match="`fill_holes` 0 is out of range; give a length above 0"):
        remesher.remesh(vertices, open_faces, 600, fill_holes=0)
    values = np.linalg.norm(np.indices((20, 20, 20)) - 9.5, axis=0)
    with pytest.raises(rtfmesh.InputError, match="`fill_holes` does not work with volumes; use `closed"):
        remesher.contour(values, 300, iso=6, fill_holes="5%")


def test_soups_are_wrapped(remesher):
    vertices, triangles = rtfmesh.sample("sphere")
    shifts = np.random.default_rng(1).uniform(-0.003, 0.003, (len(triangles), 1, 3))
    soup = (vertices[triangles] + shifts).reshape(-1, 3)
    faces = np.arange(len(soup)).reshape(-1, 3)
    result = remesher.remesh(soup, faces, 400, wrap="6%")
    assert result.report["output"]["topology"]["boundary_loops"] == 0
    # Places are those on the soup, not on the surface around it.
    found = result.correspondence
    places = np.einsum("nk,nkd->nd", found.barycentrics, soup[faces[found.triangles]])
    assert np.linalg.norm(places - result.vertices, axis=1).max() < 0.06
    with pytest.raises(rtfmesh.InputError, match="`keep_boundary` does not work with wrapped"):
        remesher.remesh(soup, faces, 400, wrap="6%", keep_boundary=True)
    with pytest.raises(rtfmesh.InputError, match="`wrap` 0 is out of range"):
        remesher.remesh(soup, faces, 400, wrap=0)
