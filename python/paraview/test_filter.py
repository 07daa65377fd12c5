"""The filter in ParaView's own Python; ci/paraview.sh runs this file."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from paraview import servermanager, simple
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkOutputWindow, vtkStringOutputWindow

simple.LoadPlugin(str(Path(__file__).with_name("rtfmesh_filter.py")), remote=False, ns=vars(simple))


@pytest.fixture
def messages():
    """A function that gives all that ParaView's window of messages has shown."""
    before, window = vtkOutputWindow.GetInstance(), vtkStringOutputWindow()
    vtkOutputWindow.SetInstance(window)
    yield window.GetOutput
    vtkOutputWindow.SetInstance(before)


def sphere(resolution=64):
    """A source with normals."""
    return simple.Sphere(ThetaResolution=resolution, PhiResolution=resolution)


def remeshed(source, **values):
    """The output of the filter."""
    step = simple.rtfmeshRemesh(Input=source, **values)
    step.UpdatePipeline()
    return servermanager.Fetch(step)


def points(data):
    """The points (V, 3)."""
    return vtk_to_numpy(data.GetPoints().GetData())


def report(data):
    """The report of the run."""
    return json.loads(data.GetFieldData().GetAbstractArray("rtfmesh").GetValue(0))


def test_surfaces_get_exactly_so_many_vertices_and_keep_their_arrays(messages):
    for source in (sphere(), simple.Superquadric(ThetaResolution=48, PhiResolution=48, Toroidal=1)):
        height = simple.Elevation(Input=source)
        bare = simple.Calculator(Input=height, ResultArrayName="twice", Function="2*coordsZ")
        plain = simple.PassArrays(Input=bare, PointDataArrays=["Elevation", "twice"])
        made = remeshed(plain, Vertices=700)
        assert made.IsA("vtkPolyData") and made.GetNumberOfPoints() == 700
        assert made.GetNumberOfCells() == made.GetNumberOfPolys()
        twice = vtk_to_numpy(made.GetPointData().GetArray("twice"))
        assert np.abs(twice - 2 * points(made)[:, 2]).max() < 0.02
        assert made.GetPointData().HasArray("Elevation")
    assert messages() == ""


def test_figures_are_in_the_field_data():
    data = remeshed(sphere(), Vertices=500, MeasureDistances=1).GetFieldData()
    found = {name: data.GetArray(name).GetValue(0) for name in ("mean_quality", "distance_rms")}
    assert 0.9 < found["mean_quality"] <= 1 and 0 < found["distance_rms"] < 1
    assert data.GetArray("min_angle").GetValue(0) > 30
    assert data.GetArray("distance_hausdorff").GetValue(0) > found["distance_rms"]
    assert not remeshed(sphere(), Vertices=500).GetFieldData().HasArray("distance_rms")
    twice = simple.rtfmeshRemesh(Input=sphere(), Vertices=500, MeasureDistances=1)
    assert not remeshed(twice, Vertices=400).GetFieldData().HasArray("distance_rms")


def test_edge_lengths_follow_the_input_and_set_the_number_of_vertices():
    source = simple.Sphere(Radius=50, ThetaResolution=64, PhiResolution=64)
    source.UpdatePipeline()
    step = simple.rtfmeshRemesh(Input=source)
    # 2 % of the largest extent, which is 100.
    assert step.EdgeLength == pytest.approx(2, abs=0.05)
    step.Size, step.EdgeLength = "Edge Length", 8
    step.UpdatePipeline()
    made = servermanager.Fetch(step)
    assert report(made)["spacing"] == pytest.approx(8, rel=0.05)
    assert 400 < made.GetNumberOfPoints() < 700
    step.EdgeLength = 16
    step.UpdatePipeline()
    assert servermanager.Fetch(step).GetNumberOfPoints() < made.GetNumberOfPoints() / 3


def test_properties_reach_the_run():
    values = {"Quality": "Best", "Sizing": "Curvature", "FeatureAngle": 91, "KeepBoundary": 1}
    options = report(remeshed(simple.Box(), Vertices=300, **values))["options"]
    own = options["coarse_to_fine"]
    assert options["iterations"] == 80 and "curvature" in own["sizing"]
    assert own["feature_angle"] == 91 and own["keep_boundary"]
    corners = [report(remeshed(simple.Box(), Vertices=300, FeatureAngle=angle)) for angle in (40, 120)]
    assert [found["features"]["corners"] for found in corners] == [8, 0]
    # Points on the seam are there twice.
    cylinder = simple.Cylinder(Resolution=32)
    counts = [remeshed(cylinder, Vertices=300, KeepUV=wanted).GetNumberOfPoints() for wanted in (0, 1)]
    assert counts[0] == 300 < counts[1]


def test_properties_have_domains():
    step = simple.rtfmeshRemesh(Input=sphere())
    for name, words in (
        ("Size", ["Vertices", "Edge Length"]),
        ("Quality", ["Draft", "Normal", "Best"]),
        ("Sizing", ["Auto", "Uniform", "Curvature"]),
    ):
        assert step.GetProperty(name).Available == words
    assert (step.Size, step.Quality, step.Sizing) == ("Vertices", "Normal", "Auto")
    with pytest.raises(ValueError):
        step.Quality = "Wonderful"
    count = step.GetProperty("Vertices").SMProperty.FindDomain("vtkSMIntRangeDomain")
    assert count.GetMinimum(0) == 4 and count.GetMinimumExists(0)
    angle = step.GetProperty("FeatureAngle").SMProperty.FindDomain("vtkSMDoubleRangeDomain")
    assert (angle.GetMinimum(0), angle.GetMaximum(0), step.FeatureAngle) == (1, 180, 40)


def test_labels_of_cells_keep_their_borders():
    plane = simple.Plane(XResolution=20, YResolution=20)
    labels = simple.ProgrammableFilter(Input=plane, CopyArrays=0)
    labels.Script = (
        "import numpy as np\n"
        "output.ShallowCopy(inputs[0].VTKObject)\n"
        "output.GetPointData().Initialize()\n"
        "output.CellData.append((np.arange(400) % 20 >= 7).astype(np.int32), 'material')\n"
    )
    made = remeshed(labels, Vertices=300, KeepLabels=1)
    faces = vtk_to_numpy(made.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    material = vtk_to_numpy(made.GetCellData().GetArray("material"))
    x = points(made)[faces][:, :, 0]
    # The border is at x = -0.15, and no triangle crosses it.
    assert (x[material == 0] < -0.15 + 1e-5).all() and (x[material == 1] > -0.15 - 1e-5).all()
    assert set(material) == {0, 1}


def test_grids_and_blocks_give_one_surface(messages):
    grid = simple.UnstructuredCellTypes(BlocksDimensions=[4, 4, 4], CellType="Tet")
    made = remeshed(grid, Vertices=600)
    assert made.GetNumberOfPoints() == 600 and report(made)["output"]["topology"]["boundary_loops"] == 0
    blocks = simple.GroupDatasets(Input=[sphere(), simple.Sphere(Center=[3, 0, 0], ThetaResolution=40)])
    made = remeshed(blocks, Vertices=800)
    assert made.GetNumberOfPoints() == 800 and report(made)["output"]["topology"]["components"] == 2
    assert messages() == ""


def test_files_are_remeshed(tmp_path):
    path = str(tmp_path / "ball.vtp")
    simple.SaveData(path, proxy=sphere())
    made = remeshed(simple.XMLPolyDataReader(FileName=[path]), Vertices=400)
    assert made.GetNumberOfPoints() == 400
    normals = vtk_to_numpy(made.GetPointData().GetArray("Normals"))
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1, abs=1e-5)


def test_errors_and_warnings_are_shown(messages):
    step = simple.rtfmeshRemesh(Input=sphere(), Vertices=3)
    step.UpdatePipeline()
    assert "rtfmesh Remesh: " in messages() and "at least 4" in messages(), messages()
    shown = len(messages())
    step.Vertices = 300
    step.UpdatePipeline()
    assert servermanager.Fetch(step).GetNumberOfPoints() == 300
    # Texture coordinates jump at the seam of a cylinder.
    remeshed(simple.Cylinder(Resolution=32), Vertices=300)
    assert "rtfmesh Remesh: texture coordinates jump" in messages()[shown:]


def test_without_the_package_an_error_says_how_to_install_it(messages, monkeypatch):
    monkeypatch.setitem(sys.modules, "rtfmesh", None)
    step = simple.rtfmeshRemesh(Input=sphere(), Vertices=300)
    step.UpdatePipeline()
    assert "rtfmesh Remesh: the package rtfmesh is not in ParaView's Python; install" in messages()


def test_runs_show_their_progress_and_can_be_stopped(messages):
    step = simple.rtfmeshRemesh(Input=sphere(200), Vertices=20_000)
    own, seen = step.GetClientSideObject(), []

    def look(*_):
        seen.append((own.GetProgress(), own.GetProgressText()))

    own.AddObserver("ProgressEvent", look)
    step.UpdatePipeline()
    fractions = [fraction for fraction, _ in seen]
    assert len({fraction for fraction in fractions if 0 < fraction < 1}) > 2
    assert any(text for _, text in seen)
    assert servermanager.Fetch(step).GetNumberOfPoints() == 20_000
    own.AddObserver("ProgressEvent", lambda *_: own.SetAbortExecute(1))
    step.Vertices = 19_999
    step.UpdatePipeline()
    assert servermanager.Fetch(step).GetNumberOfPoints() == 0 and messages() == ""
