"""The operator as users and scripts call it."""

import importlib
import time
from types import SimpleNamespace

import bpy
import numpy as np
import pytest
from support import array, cube, grid, positions, remesh, sphere


def reports(capfd):
    """What the operator has told users, which goes to the terminal without a window."""
    return capfd.readouterr().out


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"size": "FACES", "faces": 800}, 402),
        ({"size": "RATIO", "ratio": 0.5}, 241),
        ({"size": "VERTICES", "vertices": 300}, 300),
    ],
)
def test_the_size_is_given_in_several_ways(settings, expected):
    ball = sphere()
    assert len(ball.data.vertices) == 482
    assert len(remesh(**settings).data.vertices) == expected


def test_edge_lengths_are_those_that_the_scene_shows():
    ball = sphere()
    ball.scale = (4, 4, 4)
    bpy.context.view_layer.update()
    mesh = remesh(size="EDGE_LENGTH", edge_length=0.8).data
    ends = positions(mesh)[array(mesh.edges, "vertices", 2, np.int32)] * 4
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).mean() == pytest.approx(0.8, rel=0.1)


def test_triangles_are_even_in_the_scene_if_an_object_is_stretched():
    ball = sphere()
    ball.scale = (1, 1, 3)
    bpy.context.view_layer.update()
    mesh = remesh(800).data
    shown = positions(mesh) * [1, 1, 3]
    ends = shown[array(mesh.edges, "vertices", 2, np.int32)]
    lengths = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    assert lengths.std() / lengths.mean() < 0.2


def test_sharp_edges_of_the_shape_stay_unless_the_angle_forbids():
    cube()
    corners = np.abs(positions(remesh(200).data)) > 1 - 1e-5
    assert corners.all(axis=1).sum() == 8
    cube()
    corners = np.abs(positions(remesh(200, feature_angle=np.pi, keep_seams=False).data)) > 1 - 1e-5
    assert corners.all(axis=1).sum() < 8


def test_modifiers_stay_on_the_object_by_default():
    box = cube()
    box.modifiers.new("Smooth", "SUBSURF").levels = 2
    mesh = remesh(150).data
    assert len(mesh.vertices) == 150
    assert [modifier.type for modifier in box.modifiers] == ["SUBSURF"]
    # The base mesh is a cube, not the rounded body.
    assert np.abs(positions(mesh)).max() == pytest.approx(1, abs=1e-5)


def test_modifiers_are_applied_on_request():
    box = cube()
    box.modifiers.new("Mirrored", "ARRAY").count = 3
    mesh = remesh(600, apply_modifiers=True).data
    assert not box.modifiers
    assert box.data == mesh and mesh.name == "Cube"
    assert np.ptp(positions(mesh), axis=0) == pytest.approx([6, 2, 2], abs=1e-4)


def test_applied_modifiers_take_the_shape_keys_with_them_and_say_so(capfd):
    ball = sphere()
    ball.shape_key_add(name="Basis")
    for point in ball.shape_key_add(name="long").data:
        point.co.z *= 2
    ball.data.shape_keys.key_blocks["long"].value = 1
    ball.modifiers.new("Mirrored", "ARRAY").count = 2
    mesh = remesh(600, apply_modifiers=True).data
    assert mesh.shape_keys is None
    assert np.ptp(positions(mesh), axis=0) == pytest.approx([4, 2, 4], abs=0.05)
    assert "Not carried over: shape keys" in reports(capfd)


def test_a_copy_leaves_the_object_as_it_is():
    ball = sphere()
    copy = remesh(200, as_copy=True)
    assert copy != ball and len(ball.data.vertices) == 482 and len(copy.data.vertices) == 200
    assert bpy.context.selected_objects == [copy]
    assert copy.users_collection == ball.users_collection


def test_undo_brings_the_old_mesh_back():
    sphere().name = "ball"
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.object.rtfmesh_remesh("EXEC_DEFAULT", True, vertices=200, quality="DRAFT")
    assert len(bpy.data.objects["ball"].data.vertices) == 200
    bpy.ops.ed.undo()
    assert len(bpy.data.objects["ball"].data.vertices) == 482
    bpy.ops.ed.redo()
    assert len(bpy.data.objects["ball"].data.vertices) == 200


def test_input_that_is_not_manifold_keeps_its_junction():
    mesh = bpy.data.meshes.new("book")
    pages = [(1, 0, 0), (-1, 0, 0), (0, 1, 0)]
    points = [(0, 0, 0), (0, 0, 1)]
    faces = []
    for x, y, z in pages:
        faces.append((0, 1, len(points) + 1, len(points)))
        points += [(x, y, z), (x, y, z + 1)]
    mesh.from_pydata(points, [], faces)
    book = bpy.data.objects.new("book", mesh)
    bpy.context.collection.objects.link(book)
    bpy.context.view_layer.objects.active = book
    mesh = remesh(300).data
    assert len(mesh.vertices) == 300
    uses = np.bincount(array(mesh.loops, "edge_index", dtype=np.int32))
    assert uses.max() == 3
    ends = positions(mesh)[array(mesh.edges, "vertices", 2, np.int32)[uses == 3]]
    assert np.abs(ends[..., :2]).max() < 1e-5
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum() == pytest.approx(1, rel=1e-4)


def test_edges_without_faces_are_no_obstacle():
    square = grid(8)
    mesh = bpy.data.meshes.new("loose")
    points = [vertex.co[:] for vertex in square.data.vertices]
    faces = [tuple(polygon.vertices) for polygon in square.data.polygons]
    mesh.from_pydata([*points, (5, 5, 5), (6, 5, 5)], [(len(points), len(points) + 1)], faces)
    for edge in mesh.edges:
        edge.use_seam = edge.is_loose
    square.data = mesh
    assert len(remesh(200).data.vertices) == 200


def test_a_vertex_group_makes_edges_shorter():
    square = grid()
    group = square.vertex_groups.new(name="dense")
    group.add([v.index for v in square.data.vertices if v.co.x > 0], 1, "REPLACE")
    mesh = remesh(500, sizing="GROUP", density_group="dense", density=3, quality="NORMAL").data
    right = (positions(mesh)[:, 0] > 0.2).sum()
    left = (positions(mesh)[:, 0] < -0.2).sum()
    assert right > 3 * left


def test_open_boundaries_stay_exactly_on_request():
    grid(8)
    mesh = remesh(200, keep_boundary=True).data
    outer = positions(mesh)[np.abs(positions(mesh)).max(axis=1) > 1 - 1e-6]
    assert len(outer) == 32


def test_errors_are_reports_that_say_what_to_do():
    cube()
    bpy.context.object.data.clear_geometry()
    with pytest.raises(RuntimeError, match="The mesh has no faces"):
        remesh()
    grid()
    with pytest.raises(RuntimeError, match="There is no vertex group 'hair'"):
        remesh(sizing="GROUP", density_group="hair")
    before = len(bpy.context.object.data.vertices)
    with pytest.raises(RuntimeError, match=r"boundary.*vertices"):
        remesh(20, keep_boundary=True)
    assert len(bpy.context.object.data.vertices) == before


def test_the_operator_asks_for_a_mesh_in_object_mode():
    bpy.ops.object.empty_add()
    assert not bpy.ops.object.rtfmesh_remesh.poll()
    cube()
    assert bpy.ops.object.rtfmesh_remesh.poll()
    bpy.ops.object.mode_set(mode="EDIT")
    assert not bpy.ops.object.rtfmesh_remesh.poll()
    bpy.ops.object.mode_set(mode="OBJECT")


def test_what_is_wrong_with_a_result_is_a_warning(capfd):
    cube()
    remesh(20, keep_seams=False)
    assert "20 vertices, 36 triangles" in reports(capfd)
    ball = sphere()
    ball.data.normals_split_custom_set([(0, 0, 1)] * len(ball.data.loops))
    remesh(200)
    assert "Not carried over: custom normals" in reports(capfd)
    assert not any("custom_normal" in a.name for a in bpy.context.object.data.attributes)


class Window:
    """What the operator uses of a window: its manager and its status bar."""

    def __init__(self):
        self.percent = []
        self.texts = []
        self.timers = 0
        self.window = None

    def context(self):
        """A context with this window."""
        return SimpleNamespace(
            active_object=bpy.context.active_object,
            preferences=bpy.context.preferences,
            selected_objects=bpy.context.selected_objects,
            view_layer=bpy.context.view_layer,
            evaluated_depsgraph_get=bpy.context.evaluated_depsgraph_get,
            window=self,
            window_manager=self,
            workspace=SimpleNamespace(status_text_set=self.texts.append),
        )

    def progress_begin(self, least, most):
        """As that of the window manager."""

    def progress_update(self, percent):
        """As that of the window manager."""
        self.percent.append(percent)

    def progress_end(self):
        """As that of the window manager."""
        self.percent.append("end")

    def event_timer_add(self, interval, window):
        """As that of the window manager."""
        self.timers += 1
        return self

    def event_timer_remove(self, timer):
        """As that of the window manager."""
        self.timers -= 1

    def modal_handler_add(self, operator):
        """As that of the window manager."""


@pytest.fixture
def operator(extension):
    """The operator's functions, with settings and reports in place of Blender's instance."""
    module = importlib.import_module(f"{extension}.operator")
    cls = module.OBJECT_OT_rtfmesh_remesh
    settings = importlib.import_module(f"{extension}.settings").Settings.__annotations__
    values = {name: declared.keywords.get("default", "") for name, declared in settings.items()}
    told = []
    one = SimpleNamespace(**values, told=told, report=lambda kind, text: told.append((kind, text)))
    for name in ("invoke", "modal", "cancel", "end"):
        setattr(one, name, getattr(cls, name).__get__(one))
    return one


def run(operator, window, answer=None):
    """Passes timer events until the operator ends, and an event once there is progress."""
    context = window.context()
    assert operator.invoke(context, None) == {"RUNNING_MODAL"}
    assert window.timers == 1
    while (state := operator.modal(context, SimpleNamespace(type="TIMER", value=""))) == {"RUNNING_MODAL"}:
        if answer and window.percent:
            event = SimpleNamespace(type=answer, value="PRESS")
            assert operator.modal(context, event) == {"RUNNING_MODAL"}
        time.sleep(0.01)
    assert window.timers == 0 and window.percent[-1] == "end" and window.texts[-1] is None
    return state


def test_a_run_from_a_button_shows_its_progress(operator):
    sphere()
    operator.vertices = 20_000
    window = Window()
    assert run(operator, window) == {"FINISHED"}
    assert len(bpy.context.object.data.vertices) == 20_000
    percent = [one for one in window.percent if one != "end"]
    assert len(set(percent)) > 3 and percent == sorted(percent)
    assert any("Esc: cancel" in text for text in window.texts if text)


def test_esc_stops_a_run_and_leaves_the_object_as_it_is(operator):
    sphere()
    operator.vertices, operator.quality = 50_000, "BEST"
    assert run(operator, Window(), "ESC") == {"CANCELLED"}
    assert len(bpy.context.object.data.vertices) == 482
    assert operator.told == [({"INFO"}, "Cancelled; the object is unchanged")]


def test_enter_ends_a_run_early_with_a_valid_mesh(operator):
    sphere()
    operator.vertices, operator.quality = 20_000, "BEST"
    assert run(operator, Window(), "RET") == {"FINISHED"}
    assert len(bpy.context.object.data.vertices) == 20_000


def test_errors_of_the_background_are_reports(operator):
    grid()
    operator.vertices, operator.keep_boundary = 20, True
    assert run(operator, Window()) == {"CANCELLED"}
    [(kind, text)] = operator.told
    assert kind == {"ERROR"} and "boundary" in text
    operator.told.clear()
    bpy.context.object.data.clear_geometry()
    assert operator.invoke(Window().context(), None) == {"CANCELLED"}
    assert operator.told == [({"ERROR"}, "The mesh has no faces")]


def test_the_preferences_choose_the_device(extension, monkeypatch):
    import rtfmesh

    preferences = bpy.context.preferences.addons[extension].preferences
    monkeypatch.setenv("RTFMESH_DEVICE", "cpu")
    sphere()
    preferences.device = "CPU"
    remesh(200)
    if any(device["kind"] != "cpu" for device in rtfmesh.devices()):
        pytest.skip("there is a GPU")
    preferences.device = "GPU"
    with pytest.raises(RuntimeError, match=r"GPU|gpu"):
        remesh(300)
    preferences.device = "AUTO"


class Layout:
    """A layout that notes what is drawn, and checks names as Blender would."""

    def __init__(self):
        self.drawn = []
        self.button = SimpleNamespace()

    def prop(self, data, name):
        """As that of Blender's layouts."""
        assert name in data.bl_rna.properties
        self.drawn.append(name)

    def prop_search(self, data, name, searched, collection):
        """As that of Blender's layouts."""
        assert collection in searched.bl_rna.properties
        self.prop(data, name)

    def column(self, heading):
        """As that of Blender's layouts."""
        return self

    def label(self, text):
        """As that of Blender's layouts."""
        self.drawn.append(text)

    def operator(self, name, icon):
        """As that of Blender's layouts."""
        icons = bpy.types.UILayout.bl_rna.functions["prop"].parameters["icon"].enum_items
        assert icon in icons and name == "object.rtfmesh_remesh"
        return self.button


def test_the_panel_shows_all_settings_and_hands_them_to_the_operator(extension):
    panel = importlib.import_module(f"{extension}.panel").VIEW3D_PT_rtfmesh
    module = importlib.import_module(f"{extension}.settings")
    declared = set(module.Settings.__annotations__)
    assert declared <= set(bpy.ops.object.rtfmesh_remesh.get_rna_type().properties.keys())
    bpy.ops.object.empty_add()
    layout = Layout()
    panel.draw(SimpleNamespace(layout=layout), bpy.context)
    assert layout.drawn == ["Select a mesh object"]
    cube()
    settings = bpy.context.scene.rtfmesh
    settings.sizing, settings.feature_angle = "GROUP", np.pi
    drawn = set()
    for size in ("VERTICES", "FACES", "EDGE_LENGTH", "RATIO", "DEVIATION"):
        settings.size, layout = size, Layout()
        panel.draw(SimpleNamespace(layout=layout), bpy.context)
        assert size.lower() in layout.drawn
        drawn.update(layout.drawn)
    assert drawn == declared
    assert {name: getattr(settings, name) for name in declared} == vars(layout.button)
    given = module.options(settings)
    assert (given["feature_angle"], given["max_deviation"]) == (180, "0.1%")
