"""Installs the extension into an empty Blender, as a user would, before any test."""

import os
import tempfile
from pathlib import Path

# Before bpy is imported: Blender reads it at its start.
os.environ["BLENDER_USER_RESOURCES"] = tempfile.mkdtemp(prefix="rtfmesh-blender-")

import bpy
import pytest

EXTENSION = "bl_ext.user_default.rtfmesh"


@pytest.fixture(scope="session", autouse=True)
def extension():
    """Blender with the installed extension, whose name it is."""
    zips = sorted(str(path) for path in Path.cwd().glob("rtfmesh-blender-*.zip"))
    assert len(zips) == 1, "call ci/blender.sh, which builds the extension"
    bpy.ops.extensions.package_install_files(filepath=zips[0], repo="user_default", enable_on_install=True)
    return EXTENSION


@pytest.fixture(autouse=True)
def scene():
    """An empty scene for each test."""
    for mesh_object in list(bpy.data.objects):
        bpy.data.objects.remove(mesh_object)
    for collection in (bpy.data.meshes, bpy.data.materials):
        for block in list(collection):
            collection.remove(block)
    return bpy.context.scene
