"""Wrong calls of all functions: an `InputError` that names the argument and says what to do."""

import io
import pathlib
import re

import numpy as np
import pytest

import rtfmesh

V = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
F = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
PLACES = rtfmesh.Correspondence(np.zeros(2, np.uint32), np.full((2, 3), 1 / 3))
GRID = np.zeros((4, 4, 4))
RTF = {"preset": "rtf"}
LABELS, SPECK = np.zeros((2, 9, 9, 9))
LABELS[4:], SPECK[4, 4, 4] = 1, 1
RAGGED = [[0, 1, 2], [0, 1], [0, 2, 1]]
CLOUD = np.random.default_rng(1).random((3000, 3))
POINTS = rtfmesh.Mesh(V, F[:0], rtfmesh.Attributes())
BALL = rtfmesh.sample("sphere")
EDGE = BALL.faces[0, :2]


class Thing:
    """Nothing that any function takes."""


class Nothing:
    """A file that has nothing yet."""

    def read(self):
        """As a pipe without a writer."""


UNORDERED = {
    "attributes": {"face": {"l": np.array([None, "x", "x", None], object)}},
    "keep_labels": "l",
}


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: rtfmesh.remesh("scan.ply", F), "`vertices` is 'scan.ply'; read the file with rtfmesh.read"),
        (lambda: rtfmesh.remesh(pathlib.Path("a.ply"), F), "`vertices` is of type PosixPath; read the file"),
        (lambda: rtfmesh.remesh(Thing(), F, 50), "`vertices` has values of type object: it is of type Thing"),
        (lambda: rtfmesh.remesh(V, "faces", 50), "`faces` is 'faces'; give an array"),
        (lambda: rtfmesh.remesh(V, np.zeros((0, 3), int), 50), "`faces` is empty; rtfmesh.reconstruct"),
        (lambda: rtfmesh.remesh(V, F, 50, correspondence="yes"), "`correspondence` is 'yes'; use True or"),
        (lambda: rtfmesh.remesh(V, F, 50, distances="yes"), "`distances` is 'yes'; use True or"),
        (lambda: rtfmesh.remesh(V, F, 50, keep_uv="yes"), "`keep_uv` is 'yes'; use True or False"),
        (lambda: rtfmesh.remesh(V, F, 50, quality=3), "`quality`"),
        (lambda: rtfmesh.remesh(V, F, 50, seed=1.5), "`seed`"),
        (lambda: rtfmesh.remesh(V, F, 50, time_limit="soon"), "`time_limit`"),
        (lambda: rtfmesh.remesh(V, F, 50, features=[[0.5, 1.5]]), "`features` has values of type float64"),
        (lambda: rtfmesh.Remesher(timings="yes"), "`timings` is 'yes'; use True or False"),
        (lambda: rtfmesh.measure(V, F, accuracy="fine", against=(V, F)), "`accuracy` is 'fine'; give a num"),
        (lambda: rtfmesh.measure(V, F, accuracy=0.1), "`accuracy` needs `against`; remove one"),
        (lambda: rtfmesh.measure(V, F, accuracy=2, against=(V, F)), "`accuracy` 2 is out of range"),
        (lambda: rtfmesh.measure(V, F, energy=1, against=(V, F)), "`energy` is 1; use True or False"),
        (lambda: rtfmesh.measure(V, F, feature_angle="x"), "`feature_angle` is 'x'; give a number"),
        (lambda: rtfmesh.measure(V, F, against=5), "`against` is 5, not a mesh; give an rtfmesh, trimesh"),
        (lambda: rtfmesh.measure(V, F, against=V[:, :2]), "`against` has shape (4, 2); give one of shape"),
        (lambda: rtfmesh.measure("a.ply", F), "`vertices` is 'a.ply'; read the file with rtfmesh.read first"),
        (lambda: rtfmesh.inspect(V, F, "many"), "`n` is 'many'; give a whole number such as 5000, '10k'"),
        (lambda: rtfmesh.inspect(V, F, "1.2.3k"), "`n` is '1.2.3k'; give a whole number"),
        (lambda: rtfmesh.inspect(V, F, 0), "`n` is 0; give at least 1"),
        (lambda: rtfmesh.inspect(V, F, [5]), "`n` is of type list"),
        (lambda: rtfmesh.inspect(V, F, feature_angle=None), "`feature_angle` is of type NoneType; give"),
        (lambda: rtfmesh.inspect(V, F, feature_angle=999), "`feature_angle` 999 is out of range"),
        (lambda: rtfmesh.inspect(V, F, features=[[0, 9]]), "`features` has [0, 9] in row 0; give indices"),
        (lambda: rtfmesh.render((V, F), size=300), "`size` is 300; give 2 whole numbers"),
        (lambda: rtfmesh.render((V, F), size=(300, 0.5)), "`size` is (300, 0.5); give 2 whole numbers"),
        (lambda: rtfmesh.render((V, F), size=(-3, 5)), "`size` is (-3, 5); give 2 whole numbers"),
        (lambda: rtfmesh.render((V, F), 5), "`path` is of type int; give the name of a .png file"),
        (lambda: rtfmesh.render((V, F), color=5), "`color` 5 is unknown; use plain, quality, distance"),
        (lambda: rtfmesh.render((V, F), zoom="big"), "`zoom` is 'big'; give a number"),
        (lambda: rtfmesh.render((V, F), azimuth=None), "`azimuth` is of type NoneType; give a number"),
        (lambda: rtfmesh.render((V, F), edges="no"), "`edges` is 'no'; use True or False"),
        (lambda: rtfmesh.render([Thing()]), "`meshes[0]` is of type Thing, not a mesh; give"),
        (lambda: rtfmesh.render((V, F), against=(V, F)), "`color` 'distance' and `against` work only"),
        (lambda: PLACES.interpolate(F, V[:2]), "`faces` has [0, 2, 1] in row 0; give indices of the 2"),
        (lambda: PLACES.interpolate(F[:0], V), "`faces` has 0 rows, and the input had more than 0; give"),
        (lambda: PLACES.interpolate("f", V), "`faces` is 'f'; give an array"),
        (lambda: PLACES.interpolate(F, list("abcd")), "`values` has shape (4,) and values of type <U1; give"),
        (lambda: PLACES.interpolate(F, 5), "`values` has shape () and values of type int64; give numbers"),
        (lambda: rtfmesh.read(5), "`path` is of type int; give the name of a file"),
        (lambda: rtfmesh.read("a.ply", format=3), "`format` is 3; give an extension such as 'ply'"),
        (lambda: rtfmesh.read("a.ply", points="yes"), "`points` is 'yes'; use True or False"),
        (lambda: rtfmesh.write(None, V, F), "`path` is of type NoneType; give the name of a file"),
        (lambda: rtfmesh.reconstruct("a.xyz", 50), "`points` is 'a.xyz'; read the file with rtfmesh.read"),
        (lambda: rtfmesh.reconstruct(V[:, :2], 50), "`points` has shape (4, 2); give one of shape (N, 3)"),
        (lambda: rtfmesh.reconstruct(V, 50, closed="no"), "`closed` is 'no'; use True or False"),
        (lambda: rtfmesh.reconstruct(V, 50, normals=V[:2]), "`normals` has shape (2, 3); give one of shape"),
        (lambda: rtfmesh.reconstruct(V, 50, points_as="tree"), "`points_as`"),
        (lambda: rtfmesh.reconstruct(V, 50, fill_holes="wide"), "`fill_holes`"),
        (lambda: rtfmesh.contour(GRID, 50), "give either `iso`, the value on the surface, or `labels=True`"),
        (lambda: rtfmesh.contour(GRID[0], 50, iso=0), "`values` has shape (4, 4); give one of shape"),
        (lambda: rtfmesh.contour("ct.nii", 50, iso=0), "`values` is 'ct.nii'; give an array"),
        (lambda: rtfmesh.contour(GRID, 50, iso="bone"), "`iso` is 'bone'; give a number"),
        (lambda: rtfmesh.contour(GRID, 50, iso=0, spacing=2), "`spacing` has shape (); give one of"),
        (lambda: rtfmesh.contour(GRID, 50, iso=0, affine=np.zeros((4, 4))), "`affine` must be an invertible"),
        (lambda: rtfmesh.contour(GRID, 50, iso=0, inside="left"), "`inside`"),
        (lambda: rtfmesh.contour(GRID, 50, iso=0, closed="yes"), "`closed` is of type str; use True"),
        (lambda: rtfmesh.remesh(V, F, 50, device=[1]), "`device` is [1]; give an index or a name"),
        (lambda: rtfmesh.remesh(V, F, 50, device={}), "`device` is of type dict; give"),
        (lambda: rtfmesh.remesh(V, F, 50, device=1.5), "`device` is 1.5; give"),
        (lambda: rtfmesh.Remesher(True), "`device` is True; give"),
        (lambda: rtfmesh.Remesher(device_memory=True), "`device_memory` is True; use 1 to 2^30 MiB"),
        (lambda: rtfmesh.remesh(V, F, 50, device_memory=[1]), "`device_memory` is [1]; use"),
        (
            lambda: rtfmesh.remesh(V, F, 50, attributes={"vertex": V}),
            "`attributes.vertex` is of type ndarray",
        ),
        (lambda: rtfmesh.remesh(V, F, 50, attributes={"face": [1, 2]}), "`attributes.face` is [1, 2]; give"),
        (
            lambda: rtfmesh.remesh(V, F, 50, attributes={"label_names": 5}),
            "`attributes.label_names` is 5; give",
        ),
        (lambda: rtfmesh.Attributes(label_names={"a": 5}), "`attributes.label_names['a']` is 5; give a list"),
        (lambda: rtfmesh.remesh(V, F, 50, attributes={"materials": 5}), "`attributes.materials` is 5; give"),
        (lambda: rtfmesh.Attributes(5), "`attributes.vertex` is 5; give a dict of arrays by name"),
        (lambda: rtfmesh.Correspondence(1, 2).interpolate(F, V), "`triangles` has shape (); give"),
        (lambda: rtfmesh.remesh(V, F, 50, progress=lambda: None), "`progress` takes (); give a function of"),
        (lambda: rtfmesh.write("x.ply", V * np.nan, F), "`vertices` has a value in row 0 that is not finite"),
        (lambda: rtfmesh.read(Nothing()), "`path` has a read() that gives None; give a file"),
        (
            lambda: rtfmesh.remesh(np.full_like(V, np.inf), F, 50),
            "`vertices` has a value in row 0 that is not finite",
        ),
        (lambda: rtfmesh.reconstruct(V * np.nan, 50), "`points` has a value in row 0 that is not finite"),
        (lambda: rtfmesh.remesh(V, F, edge_length=0), "`edge_length` 0 is out of range; give"),
        (lambda: rtfmesh.remesh(V, F, ratio=0), "`ratio` 0 is out of range; give a number above 0"),
        (lambda: rtfmesh.remesh(V, F, ratio="half"), "`ratio` is 'half'; give a number"),
        (lambda: rtfmesh.remesh(V, F, max_deviation=0), "`max_deviation` 0 is out of range; give a length"),
        (
            lambda: rtfmesh.remesh(rtfmesh.sample("sphere"), max_deviation=1e-30),
            "`max_deviation`: so small a deviation needs",
        ),
        (lambda: rtfmesh.remesh(V, F, 50, sizing="curvature", gradation=4), "`gradation` 4 is out of range"),
        (lambda: rtfmesh.remesh(V, F, 50, sizing="anisotropic", aspect=0), "`aspect` 0 is out of range"),
        (lambda: rtfmesh.remesh(V, F, 50, seed=-1), "`seed` is '-1'; give a whole number, 0 or above"),
        (lambda: rtfmesh.remesh(V, F, 50, seed=2**70), f"`seed` is {2**70}; give a smaller number"),
        (lambda: rtfmesh.remesh(V, F, 50, iterations=-1), "`iterations` is -1; give a whole number, 0 or"),
        (lambda: rtfmesh.remesh(V, F, 50, iterations=2**40), f"`iterations` is {2**40}; give a smaller"),
        (lambda: rtfmesh.remesh(V, F, 50, edge_length=1), "`n` and `edge_length` do not go together"),
        (lambda: rtfmesh.inspect(V, F, 10**25), f"`n` is {10**25}; give at most {2**32 - 1}"),
        (lambda: rtfmesh.remesh(V, F, 50, sizing=np.zeros(4)), "`sizing` is 0 for vertex 0; give numbers"),
        (lambda: rtfmesh.remesh(V, F, 50, sizing="property:zz"), "`sizing`: the vertices have no numeric"),
        (
            lambda: rtfmesh.remesh(V, F, 50, features="no.obj"),
            "`features` is 'no.obj': there is no such file",
        ),
        (lambda: rtfmesh.inspect(V, F, features="no.obj"), "`features` is 'no.obj': there is no such file"),
        (lambda: rtfmesh.remesh(V, F, 50, fixed_points="no.xyz"), "`fixed_points` is 'no.xyz': there is no"),
        (lambda: rtfmesh.remesh(V, F, 50, smooth_labels=1), "`smooth_labels` needs `keep_labels`; add it"),
        (lambda: rtfmesh.contour(GRID, 50, iso=999), "`iso`: the volume has no surface at 999"),
        (lambda: rtfmesh.render([]), "`meshes` is empty; give at least one mesh"),
        (lambda: rtfmesh.render((V, F), size=(0, 0)), "`size`: a picture of 0 x 0 pixels"),
        (lambda: rtfmesh.render((V * np.nan, F)), "`meshes[0].vertices` has a value in row 0"),
        (lambda: rtfmesh.read("x", format="zz"), "`format` 'zz' is unknown; use one"),
        (
            lambda: rtfmesh.sample("Genus3"),
            "`name`: there is no built-in model 'Genus3'; did you mean 'genus3'?",
        ),
        (lambda: rtfmesh.measure(V, F, against=V * np.nan), "`against` has a value in row 0 that is not"),
        (lambda: rtfmesh.remesh(V, F, 50, **UNORDERED), "`attributes.face['l']` has values without an order"),
        (
            lambda: rtfmesh.remesh(BALL, 300, features=[EDGE, [0, 1000]]),
            "`features` has [0, 1000] in row 1, which is no edge; give both ends of an edge in each row",
        ),
        (lambda: rtfmesh.inspect(BALL, features=[[0, 1000]]), "`features` has [0, 1000] in row 0, which is"),
        (lambda: rtfmesh.remesh(V, F, 50, only="selection:none"), "'none'; add one to the mesh's attributes"),
        (
            lambda: rtfmesh.remesh(V, F, 50, keep="label:none"),
            "`keep`: no triangle has the label 'none'; use",
        ),
        (lambda: rtfmesh.remesh(V, F, 50, refine="label:none=1"), "`refine`: no triangle has the label"),
        (lambda: rtfmesh.read(__file__), "unknown file type '.py'; use a format for meshes (.obj,"),
        (lambda: rtfmesh.read(__file__), "or name the format with `format`"),
        (lambda: rtfmesh.read(io.BytesIO(b"")), "`path` has nothing left to read; rewind it with seek(0)"),
        (lambda: rtfmesh.read(io.BytesIO(b"a mesh")), "`path`: the content is of no known format; use a"),
        (lambda: rtfmesh.read(io.BytesIO(b"v 0 0 0"), format="obj"), "`path`: the file has no faces"),
        (lambda: rtfmesh.contour(GRID, 50, labels=True), "`values` are all 0, which is outside; give at"),
        (lambda: rtfmesh.contour(GRID, 50, labels=True, closed=True), "`values` are all 0, which is outside"),
        (lambda: rtfmesh.contour(GRID + 3, 50, labels=True), "`values` are all 3; give another label"),
        (
            lambda: rtfmesh.contour(GRID - 1, 50, labels=True),
            "`values` has -1, which is not a label; use whole",
        ),
        (lambda: rtfmesh.contour(LABELS - 1, 50, labels=True), "`values` has -1, which is not a label; use"),
        (lambda: rtfmesh.contour(LABELS * 0.5, 50, labels=True), "or give `iso` for a surface at a value"),
        (lambda: rtfmesh.contour(SPECK, 50, labels=True), "`values`: the surface has no area; give larger"),
        (lambda: rtfmesh.contour(GRID * np.nan, 50, iso=0), "`values`: no value is finite; give numbers"),
        (
            lambda: rtfmesh.contour(LABELS, 50, labels=True, keep_labels="a"),
            "`keep_labels` is 'a', and a vol",
        ),
        (lambda: rtfmesh.measure(V, features=True), "`faces` is missing; give"),
        (lambda: rtfmesh.measure(POINTS, features=True), "`faces` is empty; rtfmesh.reconstruct makes a"),
        (
            lambda: rtfmesh.measure(V, F, against=V, features=True),
            "`features` needs a mesh as `against`, and that has only points; remove `features`, or make a",
        ),
        (lambda: rtfmesh.measure(V, F, against=POINTS, energy=True), "`energy` needs a mesh as `against`"),
        (lambda: rtfmesh.inspect(POINTS), "`faces` is empty; rtfmesh.reconstruct makes a surface of points"),
        (lambda: rtfmesh.render(POINTS), "`meshes[0].faces` is empty; rtfmesh.reconstruct makes a surface"),
        (lambda: rtfmesh.locate(POINTS, V), "`mesh.faces` is empty; rtfmesh.reconstruct makes a surface"),
        (
            lambda: rtfmesh.remesh(V[:0], F[:0], 50),
            "`vertices` is empty; give a mesh with vertices and faces",
        ),
        (lambda: rtfmesh.remesh(V, [[0, 1, 1]], 50), "`faces`: no face has an area; give a surface"),
        (lambda: rtfmesh.reconstruct(V[:0], 50), "`points` has 0 different points, too few for a surface;"),
        (lambda: rtfmesh.reconstruct(V, 50), "`points` has 4 different points, too few for a surface; give"),
        (lambda: rtfmesh.reconstruct(V[[0] * 99], 50), "`points`: all are at one place; give points of"),
        (lambda: rtfmesh.render((V * 0, F)), "`meshes[0].vertices` has the same point in all rows; give"),
        (lambda: rtfmesh.measure(V, F, against=V * 0), "`against` has the same point in all rows; give"),
        (lambda: rtfmesh.measure(V, F, against=V[:0]), "`against` is empty; give a row for each point"),
        (lambda: rtfmesh.reconstruct(np.outer(range(99), V[1]), 50), "`points` lie on lines and not on a"),
        (lambda: rtfmesh.reconstruct(CLOUD, 50), "`points` fill a volume and lie on no surface; give"),
        (lambda: rtfmesh.remesh(RAGGED, F, 50), "`vertices` has rows of different lengths; give rows of"),
        (lambda: rtfmesh.remesh(V, RAGGED, 50), "`faces` has rows of different lengths; give rows of equal"),
        (lambda: rtfmesh.remesh((RAGGED, F), 50), "`vertices` has rows of different lengths; give rows of"),
        (lambda: rtfmesh.remesh((V, F), RAGGED), "`faces` is given with a whole mesh; remove it"),
        (lambda: rtfmesh.measure(V, F, against=RAGGED), "`against` has rows of different lengths; give rows"),
        (lambda: rtfmesh.render((V, F), size=RAGGED), "`size` is [[0, 1, 2], [0, 1], [0, 2, 1]]; give 2"),
        (lambda: rtfmesh.remesh(V, F, 50, features=RAGGED), "`features` has rows of different lengths; give"),
        (lambda: rtfmesh.remesh(V, F, 50, features=__file__), "`features`: "),
        (lambda: rtfmesh.remesh(V, F, 50, fixed_points=__file__), "`fixed_points`: "),
        (lambda: rtfmesh.remesh(V, F, 50, research=RTF, keep_uv=True), "remove it, or leave out `research`"),
        (lambda: rtfmesh.remesh(V, F, 50, strict=None), "`strict` is None; use True or False"),
        (lambda: rtfmesh.remesh(V, F, 50, fit=None), "`fit` is None; use True or False"),
        (lambda: rtfmesh.remesh(V, F, 50, keep_uv=None), "`keep_uv` is None; use True or False"),
        (
            lambda: rtfmesh.write("x.abc", V, F),
            "`path` x.abc: unknown file type '.abc'; name the result .obj",
        ),
        (lambda: rtfmesh.write("x", V, F), "`path` x: the file name has no extension; name the result .obj"),
        (
            lambda: rtfmesh.write("x.xyz", V, F),
            "`path` x.xyz: this format has no faces; name the result .obj",
        ),
        (lambda: rtfmesh.write((V, F), "x.ply"), "`path` is of type tuple; give the name of a file first,"),
        (
            lambda: rtfmesh.follow((V, F), (V + 99, F), [V]),
            "`result` is up to 171.4730 away from `mesh`, mor",
        ),
        (lambda: rtfmesh.follow((V, F), (V, F), [V * 1e308]), "`poses`"),
    ],
)
def test_wrong_calls_name_the_argument(call, says):
    with pytest.raises(rtfmesh.InputError) as raised:
        call()
    text = str(raised.value)
    assert says in text
    # No words of the command line or of Rust, and one line.
    assert not re.search(r"--[a-z]|::|\n", text), text


@pytest.mark.parametrize(
    ("wrong", "meant"),
    [
        ("n_points", "n"),
        ("nclus", "n"),
        ("n_vertices", "n"),
        ("progress_bar", "progress"),
        ("target_edge_length", "edge_length"),
        ("attribute", "attributes"),
        ("devise", "device"),
        ("keep_label", "keep_labels"),
        ("max_deviaton", "max_deviation"),
        ("target_faces", "n_faces"),
        ("target_vertices", "n"),
    ],
)
def test_names_that_are_near_are_suggested(wrong, meant):
    functions = ((rtfmesh.remesh, (V, F)), (rtfmesh.reconstruct, (V,)), (rtfmesh.contour, (GRID,)))
    for function, first in functions:
        extra = {"iso": 0.5} if function is rtfmesh.contour else {}
        with pytest.raises(TypeError) as raised:
            function(*first, **{wrong: 5}, **extra)
        says = f"{function.__name__}() got an unexpected keyword argument '{wrong}'"
        assert str(raised.value) == f"{says}; did you mean '{meant}'?"


@pytest.mark.parametrize(
    ("call", "meant"),
    [
        (lambda: rtfmesh.measure(V, F, agianst=V), "'against'"),
        (lambda: rtfmesh.inspect(V, F, feature_angel=5), "'feature_angle'"),
        (lambda: rtfmesh.render((V, F), colour="plain"), "'color'"),
        (lambda: rtfmesh.read("x", formatt="ply"), "'format'"),
        (lambda: rtfmesh.write("x.ply", V, F, attribute=1), "'attributes'"),
        (lambda: rtfmesh.locate((V, F), V, normal=V), "'normals'"),
        (lambda: rtfmesh.Remesher(devise=1), "'device'"),
        (lambda: rtfmesh.contour(GRID, 50, level=0), "'iso'"),
        (lambda: rtfmesh.render((V, F), out="a.png"), "'path'"),
        (lambda: rtfmesh.write(filename="a.ply", vertices=(V, F)), "'path'"),
    ],
)
def test_near_names_are_suggested_by_all_functions(call, meant):
    with pytest.raises(TypeError, match=rf"; did you mean {meant}\?$"):
        call()


def test_who_wants_a_file_is_told_of_write(remesher):
    for call in (rtfmesh.remesh, remesher.remesh):
        with pytest.raises(TypeError, match=r"'out'; rtfmesh\.write writes a mesh to a file$"):
            call(V, F, 50, out="a.ply")


def test_devices_that_there_are_not_are_named(monkeypatch):
    with pytest.raises(rtfmesh.DeviceError, match=r"^`device` is 'quantum', .*; use one of these: 0 "):
        rtfmesh.remesh(V, F, 50, device="quantum")
    monkeypatch.setenv("RTFMESH_DEVICE", "quantum")
    with pytest.raises(rtfmesh.DeviceError, match=r"^RTFMESH_DEVICE is 'quantum', which matches no device"):
        rtfmesh.remesh(V, F, 50)


def test_arguments_are_suggested_before_settings_for_research():
    with pytest.raises(TypeError, match=r"'face'; did you mean 'faces'\?$"):
        rtfmesh.remesh(V, face=F, n=50)
    with pytest.raises(TypeError, match=r"'face'; did you mean research=\{'face': 'power'\}\?$"):
        rtfmesh.reconstruct(V, 50, face="power")


def test_no_function_suggests_what_it_lacks(remesher):
    with pytest.raises(TypeError, match=r"'correspondence'$"):
        rtfmesh.reconstruct(V, 50, correspondence=False)
    with pytest.raises(TypeError, match=r"'device'$"):
        remesher.remesh(V, F, 50, device="cpu")
    with pytest.raises(TypeError, match=r"research=\{'normals': \.\.\.\}"):
        rtfmesh.remesh(V, F, 50, normals=V)


def test_pictures_without_a_folder_are_output_errors():
    with pytest.raises(rtfmesh.OutputError, match=r"nodir/a\.png: "):
        rtfmesh.render((V, F), "/nodir/a.png")


def test_pairs_may_be_lists():
    assert rtfmesh.measure(V, F, against=[V, F]) == rtfmesh.measure(V, F, against=(V, F))
    assert len(rtfmesh.remesh([V, F], 50, attributes=True).vertices) == 50


def test_names_that_mean_nothing_are_not_guessed():
    with pytest.raises(TypeError, match=r"'zzz'$"):
        rtfmesh.remesh(V, F, 50, zzz=1)


def test_counts_are_read_alike_everywhere():
    found = [rtfmesh.inspect(V, F, n) for n in ("2k", 2000, 2000.0, "2.0k", np.int64(2000))]
    assert all(one == found[0] for one in found)


def test_notes_have_no_flags(remesher):
    rng = np.random.default_rng(1)
    ground = np.column_stack([rng.uniform(0, 100, (6000, 2)), rng.normal(0, 0.02, 6000)])
    trees = np.column_stack([rng.uniform(0, 100, (600, 2)), rng.uniform(3, 9, 600)])
    result = remesher.reconstruct(np.vstack([ground, trees]), 500, points_as="terrain")
    notes = " ".join(result.report["notes"])
    assert "`points_as`" in notes and "--" not in notes
