"""Borders between many labels: which numbers of vertices suffice, and what regions become."""

import re

import numpy as np
import pytest

import rtfmesh


def cube(side):
    """A cube of so many squares along each edge, as vertices and faces, two for each square in turn."""
    numbers, faces = {}, []
    corners = ((0, 0), (1, 0), (1, 1), (0, 1))
    for axis, height, i, j in np.ndindex(3, 2, side, side):
        places = np.zeros((4, 3), int)
        places[:, axis] = height * side
        for corner, (di, dj) in enumerate(corners):
            places[corner, (axis + 1) % 3], places[corner, (axis + 2) % 3] = i + di, j + dj
        a, b, c, d = (numbers.setdefault(tuple(place), len(numbers)) for place in places)
        faces += [[a, b, c], [a, c, d]] if height else [[c, b, a], [d, c, a]]
    return np.array(list(numbers), float), np.array(faces)


def areas(vertices, faces, labels):
    """The area of each label."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.bincount(labels, np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)


def test_more_vertices_never_fail_where_fewer_suffice(remesher):
    vertices, faces = cube(4)
    squares = np.arange(len(faces)) // 2

    def run(n):
        return remesher.remesh(
            vertices, faces, n, attributes={"face": {"square": squares}}, keep_labels="square"
        )

    asked = set()
    for n in (60, 90, 97):
        with pytest.raises(rtfmesh.InputError, match=r"borders of labels.* need 98 vertices") as raised:
            run(n)
        asked.add(int(re.search(r"ask for (\d+) vertices", str(raised.value))[1]))
    # What the error asks for is enough, and so is all above. Less is, too, down to the squares' corners.
    (enough,) = asked
    for n in (98, 99, 150, 300, enough - 1, enough, enough + 37, 2 * enough):
        result = run(n)
        assert len(result.vertices) == n
        found = areas(result.vertices, result.faces, result.attributes.face["square"])
        assert np.allclose(found, 1.0, atol=1e-6)


def test_regions_with_ragged_borders_keep_their_areas(remesher):
    ball = rtfmesh.sample("sphere")
    centres = np.random.default_rng(3).normal(size=(12, 3))
    centres /= np.linalg.norm(centres, axis=1)[:, None]
    # Which centre is nearest: every border runs along the edges of triangles, in teeth.
    labels = np.argmax(ball.vertices[ball.faces].mean(axis=1) @ centres.T, axis=1)
    expected = areas(ball.vertices, ball.faces, labels)
    for n in (500, 1000):
        result = remesher.remesh(ball, n, attributes={"face": {"cell": labels}}, keep_labels=True)
        assert len(result.vertices) == n and result.report["warnings"] == []
        found = areas(result.vertices, result.faces, result.attributes.face["cell"])
        assert np.abs(found / expected - 1).max() < 0.03
        quality = result.report["output"]["quality"]
        assert quality["mean_quality"] > 0.88 and quality["min_angle"] > 15


HALF = rtfmesh.sample("torus").vertices[rtfmesh.sample("torus").faces].mean(axis=1)[:, 0] > 0


@pytest.mark.parametrize(
    "values",
    [HALF, HALF.astype(np.uint8), HALF.astype(np.int64) - 5, np.where(HALF, "right", "left")],
    ids=["bool", "uint8", "int64", "str"],
)
def test_labels_of_all_types_give_the_same_borders(torus, remesher, values):
    result = remesher.remesh(torus, 400, attributes={"face": {"half": values}}, keep_labels=True)
    expected = remesher.remesh(torus, 400, attributes={"face": {"half": HALF}}, keep_labels=True)
    assert np.array_equal(result.vertices, expected.vertices)
    assert np.array_equal(result.attributes.face["half"] == values[HALF][0], expected.attributes.face["half"])
    assert result.attributes.face["half"].dtype == values.dtype
    # No face crosses the border, which is kept.
    right = result.vertices[result.faces][expected.attributes.face["half"]]
    assert right[..., 0].min() > -0.1
    # Numbers with a fraction are no labels.
    given = {"face": {"half": HALF.astype(float)}}
    with pytest.warns(rtfmesh.MeshWarning, match="`keep_labels` has no effect: the input has no labels"):
        other = remesher.remesh(torus, 400, attributes=given, keep_labels=True)
    assert np.array_equal(other.vertices, remesher.remesh(torus, 400).vertices)
