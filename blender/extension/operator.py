"""The operator that remeshes the active object."""

import bpy
import numpy as np
import rtfmesh
from bpy.types import Operator

from .carry import remesh
from .job import Job
from .settings import Settings, draw, options
from .surface import read
from .write import write

# Seconds between two looks at a run.
INTERVAL = 0.1


class OBJECT_OT_rtfmesh_remesh(Settings, Operator):
    """Remesh the active object into even triangles; UVs, materials, groups and shape keys are carried over"""

    bl_idname = "object.rtfmesh_remesh"
    bl_label = "Remesh with rtfmesh"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """Whether there is something to remesh; called by Blender."""
        mesh_object = context.active_object
        if mesh_object is None or mesh_object.type != "MESH":
            cls.poll_message_set("Select a mesh object")
        elif mesh_object.mode != "OBJECT":
            cls.poll_message_set("Switch to object mode")
        elif mesh_object.library or mesh_object.data.library:
            cls.poll_message_set("The object is linked from another file; make it local")
        else:
            return True
        return False

    def draw(self, context):
        """The settings under the last operation; called by Blender."""
        draw(self.layout, self, context.active_object)

    def execute(self, context):
        """Remeshes and waits for the result; called for scripts and repetitions."""
        try:
            work, surface = prepare(context, self)
            return apply(context, self, surface, *work(lambda _: None))
        except (rtfmesh.Error, Unsuitable) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}

    def invoke(self, context, event):
        """Begins a run in the background; called for buttons and menus."""
        try:
            work, self._surface = prepare(context, self)
        except Unsuitable as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self._job = Job(work)
        self._job.start()
        manager = context.window_manager
        manager.progress_begin(0, 100)
        self._timer = manager.event_timer_add(INTERVAL, window=context.window)
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Shows the progress until the run ends; called for each event."""
        if event.type == "ESC":
            self._job.cancel()
        elif event.type in {"RET", "NUMPAD_ENTER"} and event.value == "PRESS":
            self._job.finish_early()
        if event.type != "TIMER":
            return {"RUNNING_MODAL"}
        if not self._job.is_done():
            percent = round(100 * self._job.fraction)
            context.window_manager.progress_update(percent)
            keys = "Esc: cancel, Enter: finish early"
            context.workspace.status_text_set(f"rtfmesh: {self._job.phase}, {percent} %  ({keys})")
            return {"RUNNING_MODAL"}
        self.end(context)
        try:
            return apply(context, self, self._surface, *self._job.wait())
        except rtfmesh.Cancelled:
            self.report({"INFO"}, "Cancelled; the object is unchanged")
        except rtfmesh.Error as error:
            self.report({"ERROR"}, str(error))
        return {"CANCELLED"}

    def cancel(self, context):
        """Stops the run; called if Blender ends the operator, such as by loading a file."""
        self._job.cancel()
        self.end(context)

    def end(self, context):
        """Removes what shows the progress."""
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)


class Unsuitable(Exception):
    """An object or a setting that does not fit; the text is for the user."""


def device(context):
    """The device that the preferences ask for; None is the best."""
    addon = context.preferences.addons.get(__package__)
    chosen = addon.preferences.device if addon else "AUTO"
    return None if chosen == "AUTO" else chosen.lower()


def prepare(context, settings):
    """The work of a run as a function of rtfmesh's callback, and the surface that it remeshes."""
    mesh_object = context.active_object
    if settings.apply_modifiers:
        evaluated = mesh_object.evaluated_get(context.evaluated_depsgraph_get())
        mesh = evaluated.to_mesh(preserve_all_data_layers=True, depsgraph=context.evaluated_depsgraph_get())
    else:
        mesh = mesh_object.data
    try:
        if not mesh.polygons:
            raise Unsuitable("The mesh has no faces")
        scale = np.abs(mesh_object.matrix_world.to_scale())
        # A flattened object is remeshed as if it were not.
        scale = scale if scale.min() > 1e-6 * scale.max() else np.ones(3)
        surface = read(mesh, len(mesh_object.vertex_groups), scale)
    finally:
        if settings.apply_modifiers:
            evaluated.to_mesh_clear()
    if settings.apply_modifiers and mesh_object.data.shape_keys:
        surface.left_out.append("shape keys, which modifiers were applied to")
    given = options(settings)
    if settings.sizing == "GROUP":
        given["sizing"] = sizes(mesh_object, surface, settings)
    on = device(context)
    # The settings may be gone when the thread reads them.
    kept = Kept(settings)
    return lambda progress: remesh(surface, given, kept, on, progress), surface


class Kept:
    """The settings of what is kept, as they were at the start."""

    def __init__(self, settings):
        for name in ("keep_sharp", "keep_seams", "keep_materials"):
            setattr(self, name, getattr(settings, name))


def sizes(mesh_object, surface, settings):
    """The numbers that edge lengths are proportional to, by a vertex group."""
    group = mesh_object.vertex_groups.get(settings.density_group)
    if group is None:
        raise Unsuitable(f"There is no vertex group '{settings.density_group}'")
    return settings.density ** -surface.groups[:, group.index]


def apply(context, operator, surface, result, keys):
    """Puts a result into the active object or a copy of it, and tells what came of it."""
    mesh_object = context.active_object
    if operator.as_copy:
        mesh_object = copied(context, mesh_object)
    if operator.apply_modifiers:
        apply_modifiers(context, mesh_object)
    write(mesh_object.data, surface, result, keys)
    for warning in result.report["warnings"]:
        operator.report({"WARNING"}, warning)
    if surface.left_out:
        operator.report({"WARNING"}, f"Not carried over: {', '.join(surface.left_out)}")
    quality = result.report["output"]["quality"]
    counts = f"{len(result.vertices):,} vertices, {len(result.faces):,} triangles"
    angles = f"mean quality {quality['mean_quality']:.3f}, angles from {quality['min_angle']:.0f}°"
    operator.report({"INFO"}, f"{counts}, {angles}")
    return {"FINISHED"}


def copied(context, mesh_object):
    """A copy of an object with a mesh of its own, which is the only selected object then."""
    copy = mesh_object.copy()
    copy.data = mesh_object.data.copy()
    for collection in mesh_object.users_collection:
        collection.objects.link(copy)
    for other in context.selected_objects:
        other.select_set(False)
    copy.select_set(True)
    context.view_layer.objects.active = copy
    return copy


def apply_modifiers(context, mesh_object):
    """Gives an object the mesh that its modifiers make, and removes them."""
    graph = context.evaluated_depsgraph_get()
    evaluated = mesh_object.evaluated_get(graph)
    mesh = bpy.data.meshes.new_from_object(evaluated, preserve_all_data_layers=True, depsgraph=graph)
    old, name = mesh_object.data, mesh_object.data.name
    mesh_object.modifiers.clear()
    mesh_object.data = mesh
    if not old.users:
        bpy.data.meshes.remove(old)
        mesh.name = name
