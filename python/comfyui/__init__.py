"""Nodes for ComfyUI: load, remesh and save a mesh.

Copy this folder into `custom_nodes` as `rtfmesh` and install its requirements. Meshes are of trimesh (type
TRIMESH), as in the nodes of other packages.
"""

import json
import os
from pathlib import Path

import trimesh

import rtfmesh

FORMATS = ("glb", "obj", "ply", "stl")


def folders():
    """ComfyUI's module of folders; not there outside of ComfyUI."""
    import folder_paths

    return folder_paths


def input_files():
    """The mesh files in ComfyUI's input folder, relative to it."""
    top = Path(folders().get_input_directory())
    found = (path for path in top.rglob("*") if path.suffix[1:].lower() in FORMATS)
    return sorted(path.relative_to(top).as_posix() for path in found)


def input_path(file):
    """The place of a file of the input folder; refuses all others."""
    top = Path(folders().get_input_directory()).resolve()
    path = (top / file).resolve()
    if not path.is_relative_to(top) or not path.is_file():
        raise ValueError(f"there is no file {file} in ComfyUI's input folder")
    return path


class Run:
    """Moves ComfyUI's bar and stops when the user does; called with a Progress. Does nothing elsewhere."""

    def __init__(self):
        try:
            from comfy.model_management import processing_interrupted
            from comfy.utils import ProgressBar
        except ImportError:
            self.bar, self.is_stopped = None, lambda: False
        else:
            self.bar, self.is_stopped = ProgressBar(100), processing_interrupted

    def __call__(self, progress):
        """What to do next, in the words of rtfmesh."""
        self.show(progress.fraction)
        return "cancel" if self.is_stopped() else None

    def show(self, fraction):
        """Moves the bar."""
        if self.bar:
            self.bar.update_absolute(round(100 * fraction))


class RtfmeshLoad:
    """Loads a mesh file of the input folder."""

    CATEGORY = "rtfmesh"
    FUNCTION = "load"
    RETURN_TYPES = ("TRIMESH",)
    RETURN_NAMES = ("mesh",)

    @classmethod
    def INPUT_TYPES(cls):
        """What ComfyUI asks for."""
        return {"required": {"file": (input_files(),)}}

    @classmethod
    def IS_CHANGED(cls, file):
        """Differs after the file was written again."""
        return os.stat(input_path(file)).st_mtime_ns

    def load(self, file):
        """The mesh; a scene becomes one mesh."""
        return (trimesh.load_mesh(input_path(file)),)


class RtfmeshRemesh:
    """Remeshes into well-shaped triangles with exactly N vertices; colours and textures are carried over."""

    CATEGORY = "rtfmesh"
    FUNCTION = "remesh"
    RETURN_TYPES = ("TRIMESH", "STRING")
    RETURN_NAMES = ("mesh", "report")

    @classmethod
    def INPUT_TYPES(cls):
        """What ComfyUI asks for."""
        return {
            "required": {
                "mesh": ("TRIMESH",),
                "vertices": ("INT", {"default": 10_000, "min": 4, "max": 2**31 - 1}),
                "quality": (["normal", "draft", "best"],),
            },
            "optional": {
                "feature_angle": ("FLOAT", {"default": 40.0, "min": 0.0, "max": 180.0}),
                "sizing": (["auto", "uniform", "curvature"],),
                "keep_uv": ("BOOLEAN", {"default": True}),
                "seed": ("INT", {"default": 1, "min": 0, "max": 2**32 - 1}),
            },
        }

    def remesh(self, mesh, vertices, quality, feature_angle=40.0, sizing="auto", keep_uv=True, seed=1):
        """The new mesh, and the report as JSON."""
        run = Run()
        has_uv = getattr(mesh.visual, "uv", None) is not None
        try:
            result = rtfmesh.trimesh.remesh(
                mesh,
                vertices,
                quality=quality,
                feature_angle=feature_angle,
                sizing=sizing,
                keep_uv=keep_uv and has_uv,
                seed=seed,
                progress=run,
            )
        except rtfmesh.Cancelled:
            from comfy.model_management import throw_exception_if_processing_interrupted

            # The exception by which ComfyUI ends a workflow without an error.
            throw_exception_if_processing_interrupted()
            raise
        run.show(1)
        return (result, json.dumps(result.metadata["rtfmesh"], indent=2))


class RtfmeshSave:
    """Saves a mesh into the output folder, under a new number."""

    CATEGORY = "rtfmesh"
    FUNCTION = "save"
    OUTPUT_NODE = True
    RETURN_TYPES = ("STRING",)
    RETURN_NAMES = ("path",)

    @classmethod
    def INPUT_TYPES(cls):
        """What ComfyUI asks for."""
        return {
            "required": {
                "mesh": ("TRIMESH",),
                "prefix": ("STRING", {"default": "rtfmesh"}),
                "format": (list(FORMATS),),
            }
        }

    def save(self, mesh, prefix, format):
        """The path of the file."""
        paths = folders()
        folder, name, counter, *_ = paths.get_save_image_path(prefix, paths.get_output_directory())
        path = Path(folder) / f"{name}_{counter:05}_.{format}"
        # Not the report, which would be in the file.
        kept = mesh.copy()
        kept.metadata.pop("rtfmesh", None)
        kept.export(path)
        return {"ui": {"text": [path.name]}, "result": (str(path),)}


NODE_CLASS_MAPPINGS = {
    "RtfmeshLoad": RtfmeshLoad,
    "RtfmeshRemesh": RtfmeshRemesh,
    "RtfmeshSave": RtfmeshSave,
}
NODE_DISPLAY_NAME_MAPPINGS = {
    "RtfmeshLoad": "Load mesh (rtfmesh)",
    "RtfmeshRemesh": "Remesh (rtfmesh)",
    "RtfmeshSave": "Save mesh (rtfmesh)",
}
