"""The filter "rtfmesh Remesh" for ParaView: surfaces in well-shaped triangles with exactly N vertices.

Load this file in Tools > Manage Plugins, or with `LoadPlugin` in pvpython; docs/python.md says how ParaView's
Python gets the package rtfmesh.
"""

import json
import warnings

import numpy as np
from paraview.util.vtkAlgorithm import VTKPythonAlgorithmBase, smdomain, smproperty, smproxy
from vtkmodules.vtkCommonCore import vtkOutputWindow
from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkPolyData
from vtkmodules.vtkCommonExecutionModel import vtkAlgorithm

INSTALL = (
    "the package rtfmesh is not in ParaView's Python; install its wheel with `pip install --no-deps --target "
    "FOLDER`, and start ParaView with PYTHONPATH=FOLDER"
)
QUALITIES = ("draft", "normal", "best")
SIZINGS = ("auto", "uniform", "curvature")


def choice(label, entries, default, text):
    """The declaration of a property that is one of several words; in Python its label is its name."""
    name = label.replace(" ", "")
    listed = "".join(f'<Entry value="{value}" text="{entry}"/>' for value, entry in enumerate(entries))
    return f"""
      <IntVectorProperty name="{name}" label="{label}" command="Set{name}" number_of_elements="1"
          default_values="{default}">
        <EnumerationDomain name="enum">{listed}</EnumerationDomain>
        <Documentation>{text}</Documentation>
      </IntVectorProperty>"""


def switch(label, text):
    """The declaration of a property that is off by default."""
    name = label.replace(" ", "")
    return f"""
      <IntVectorProperty name="{name}" label="{label}" command="Set{name}" number_of_elements="1"
          default_values="0">
        <BooleanDomain name="bool"/>
        <Documentation>{text}</Documentation>
      </IntVectorProperty>"""


def shown_with_size(value):
    """The hint that shows a property only for one way to give the size."""
    return f"""
        <Hints>
          <PropertyWidgetDecorator type="GenericDecorator" mode="visibility" property="Size"
              value="{value}"/>
        </Hints>"""


# In this order; with a decorator for each method, ParaView sorts them by name.
PROPERTIES = "".join(
    (
        choice("Size", ("Vertices", "Edge Length"), 0, "How the size of the result is given."),
        f"""
      <IntVectorProperty name="Vertices" label="Vertices" command="SetVertices"
          number_of_elements="1" default_values="10000">
        <IntRangeDomain name="range" min="4"/>
        <Documentation>Exact number of vertices, of all blocks together.</Documentation>{shown_with_size(0)}
      </IntVectorProperty>
      <DoubleVectorProperty name="EdgeLength" label="Edge Length" command="SetEdgeLength"
          number_of_elements="1" default_values="0.01">
        <BoundsDomain name="range" mode="scaled_extent" scale_factor="0.02">
          <RequiredProperties><Property function="Input" name="Input"/></RequiredProperties>
        </BoundsDomain>
        <Documentation>Target edge length, in units of the input.</Documentation>{shown_with_size(1)}
      </DoubleVectorProperty>""",
        choice("Quality", ("Draft", "Normal", "Best"), 1, "Speed or quality."),
        choice(
            "Sizing",
            ("Auto", "Uniform", "Curvature"),
            0,
            "Auto: equal, but shorter around details that equal edges would miss. Uniform: equal everywhere. "
            "Curvature: shorter where the surface is curved.",
        ),
        """
      <DoubleVectorProperty name="FeatureAngle" label="Feature Angle" command="SetFeatureAngle"
          number_of_elements="1" default_values="40">
        <DoubleRangeDomain name="range" min="1" max="180"/>
        <Documentation>Keep edges at which the surface turns by more than this many degrees; 180 keeps
        none.</Documentation>
      </DoubleVectorProperty>""",
        switch("Keep Boundary", "Keep the vertices and edges of boundaries exactly."),
        switch(
            "Keep Labels",
            "Keep the borders between the values of integer cell arrays.",
        ),
        switch(
            "Keep UV",
            "Put vertices on the seams of texture coordinates, where points are there once for each side.",
        ),
        switch(
            "Measure Distances",
            "Add the distances between input and result to the field data, in percent of the diagonal of the "
            "input's bounding box.",
        ),
    )
)


FIGURES = ("mean_quality", "min_angle", "distance_rms", "distance_hausdorff")


def figures(report):
    """What the field data has of a report, by name."""
    output = report["output"]
    found = {name: output["quality"][name] for name in ("mean_quality", "min_angle")}
    if output["distances"]:
        found |= {f"distance_{name}": output["distances"][name] for name in ("rms", "hausdorff")}
    return found


@smproxy.filter(name="RtfmeshRemesh", label="rtfmesh Remesh")
@smproperty.xml(PROPERTIES)
@smproperty.input(name="Input", port_index=0)
@smdomain.datatype(dataTypes=["vtkPolyData", "vtkUnstructuredGrid"])
class RtfmeshRemesh(VTKPythonAlgorithmBase):
    """Remeshes a surface, the surface of a grid, or those of all blocks as one."""

    def __init__(self):
        super().__init__(nInputPorts=1, nOutputPorts=1, outputType="vtkPolyData")
        self.values = {
            "Size": 0,
            "Vertices": 10_000,
            "EdgeLength": 0.01,
            "Quality": 1,
            "Sizing": 0,
            "FeatureAngle": 40.0,
            "KeepBoundary": 0,
            "KeepLabels": 0,
            "KeepUV": 0,
            "MeasureDistances": 0,
        }

    def take(self, name, value):
        """Sets a property."""
        if self.values[name] != value:
            self.values[name] = value
            self.Modified()

    def SetSize(self, value):
        """0: by the number of vertices, 1: by the edge length."""
        self.take("Size", value)

    def SetVertices(self, value):
        """At least 4."""
        self.take("Vertices", value)

    def SetEdgeLength(self, value):
        """In units of the input."""
        self.take("EdgeLength", value)

    def SetQuality(self, value):
        """The place in `QUALITIES`."""
        self.take("Quality", value)

    def SetSizing(self, value):
        """The place in `SIZINGS`."""
        self.take("Sizing", value)

    def SetFeatureAngle(self, value):
        """In degrees."""
        self.take("FeatureAngle", value)

    def SetKeepBoundary(self, value):
        """0 or 1, as for the switches below."""
        self.take("KeepBoundary", value)

    def SetKeepLabels(self, value):
        """Whether borders of labels are kept."""
        self.take("KeepLabels", value)

    def SetKeepUV(self, value):
        """Whether seams are kept."""
        self.take("KeepUV", value)

    def SetMeasureDistances(self, value):
        """Whether distances are measured."""
        self.take("MeasureDistances", value)

    def options(self):
        """The keyword arguments of `rtfmesh.vtk.remesh`."""
        values = self.values
        size = {"edge_length": values["EdgeLength"]} if values["Size"] else {"n": values["Vertices"]}
        return {
            **size,
            "quality": QUALITIES[values["Quality"]],
            "sizing": SIZINGS[values["Sizing"]],
            "feature_angle": values["FeatureAngle"],
            "keep_boundary": bool(values["KeepBoundary"]),
            "keep_labels": bool(values["KeepLabels"]),
            "keep_uv": bool(values["KeepUV"]),
            "distances": bool(values["MeasureDistances"]),
            "progress": self.told,
        }

    def told(self, progress):
        """Moves ParaView's bar, and stops the run if the user did."""
        self.SetProgressText(progress.phase)
        self.UpdateProgress(progress.fraction)
        return "cancel" if self.GetAbortExecute() else None

    def FillInputPortInformation(self, port, info):
        """Any data object: blocks would come one by one otherwise, each with all vertices."""
        info.Set(vtkAlgorithm.INPUT_REQUIRED_DATA_TYPE(), "vtkDataObject")
        return 1

    def RequestData(self, request, inInfo, outInfo):
        """Makes the output; failures and warnings are shown as ParaView's."""
        window = vtkOutputWindow.GetInstance()
        output = vtkPolyData.GetData(outInfo, 0)
        try:
            import rtfmesh
            from rtfmesh.vtk import add_array, remesh
        except ImportError as error:
            window.DisplayErrorText(f"rtfmesh Remesh: {INSTALL} ({error})\n")
            return 0
        try:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always", rtfmesh.MeshWarning)
                made = remesh(vtkDataObject.GetData(inInfo[0], 0), **self.options())
        except rtfmesh.Cancelled:
            output.Initialize()
            return 1
        except rtfmesh.Error as error:
            window.DisplayErrorText(f"rtfmesh Remesh: {error}\n")
            return 0
        for warning in caught:
            window.DisplayWarningText(f"rtfmesh Remesh: {warning.message}\n")
        report = json.loads(made.GetFieldData().GetAbstractArray("rtfmesh").GetValue(0))
        # Those of a filter before this one came along.
        for name in FIGURES:
            made.GetFieldData().RemoveArray(name)
        for name, value in figures(report).items():
            add_array(made.GetFieldData(), name, np.array([value], dtype=float))
        output.ShallowCopy(made)
        return 1
