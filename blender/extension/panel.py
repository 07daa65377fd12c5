"""What users see: the panel in the sidebar of the 3D view, and the preferences."""

from bpy.props import EnumProperty
from bpy.types import AddonPreferences, Panel

from .operator import OBJECT_OT_rtfmesh_remesh
from .settings import Settings, draw


class RtfmeshPreferences(AddonPreferences):
    """The preferences of the extension."""

    bl_idname = __package__

    device: EnumProperty(
        name="Device",
        items=[
            ("AUTO", "Automatic", "The best GPU, or the CPU if there is none"),
            ("GPU", "GPU", "A GPU"),
            ("CPU", "CPU", "The CPU"),
        ],
        default="AUTO",
    )

    def draw(self, context):
        """Called by Blender."""
        self.layout.prop(self, "device")


class VIEW3D_PT_rtfmesh(Panel):
    """The panel in the sidebar of the 3D view."""

    bl_label = "Remesh"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "rtfmesh"

    def draw(self, context):
        """Called by Blender."""
        mesh_object = context.active_object
        if mesh_object is None or mesh_object.type != "MESH":
            self.layout.label(text="Select a mesh object")
            return
        settings = context.scene.rtfmesh
        draw(self.layout, settings, mesh_object)
        operator = self.layout.operator(OBJECT_OT_rtfmesh_remesh.bl_idname, icon="MOD_REMESH")
        for name in Settings.__annotations__:
            setattr(operator, name, getattr(settings, name))
