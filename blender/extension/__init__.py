"""Remeshes objects of Blender with rtfmesh."""

import bpy

from .operator import OBJECT_OT_rtfmesh_remesh
from .panel import RtfmeshPreferences, VIEW3D_PT_rtfmesh
from .settings import RtfmeshSettings

CLASSES = (RtfmeshPreferences, RtfmeshSettings, OBJECT_OT_rtfmesh_remesh, VIEW3D_PT_rtfmesh)


def register():
    """Called by Blender when the extension is enabled."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Scene.rtfmesh = bpy.props.PointerProperty(type=RtfmeshSettings)


def unregister():
    """Called by Blender when the extension is disabled."""
    del bpy.types.Scene.rtfmesh
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
