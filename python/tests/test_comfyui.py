"""The nodes for ComfyUI, as ComfyUI calls them."""

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
import trimesh

import rtfmesh


class Interrupted(Exception):
    """What ComfyUI raises when the user stops a workflow."""


@pytest.fixture
def comfy(monkeypatch, tmp_path):
    """What the nodes use of ComfyUI: its folders, its bar, and whether the user wants to stop."""
    for name in ("input", "output"):
        (tmp_path / name).mkdir()
    state = SimpleNamespace(folder=tmp_path, bar=[], stop=False, saved=0)

    def save_path(prefix, folder):
        state.saved += 1
        return folder, prefix, state.saved, "", prefix

    def stopped():
        if state.stop:
            raise Interrupted

    modules = {
        "folder_paths": {
            "get_input_directory": lambda: str(tmp_path / "input"),
            "get_output_directory": lambda: str(tmp_path / "output"),
            "get_save_image_path": save_path,
        },
        "comfy": {},
        "comfy.utils": {"ProgressBar": lambda _: SimpleNamespace(update_absolute=state.bar.append)},
        "comfy.model_management": {
            "processing_interrupted": lambda: state.stop,
            "throw_exception_if_processing_interrupted": stopped,
        },
    }
    for name, content in modules.items():
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    return state


@pytest.fixture
def nodes():
    """The nodes by name."""
    path = Path(__file__).parents[1] / "comfyui/__init__.py"
    spec = importlib.util.spec_from_file_location("rtfmesh_nodes", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.NODE_CLASS_MAPPINGS.keys() == module.NODE_DISPLAY_NAME_MAPPINGS.keys()
    return module.NODE_CLASS_MAPPINGS


def call(node, **inputs):
    """The results of a node whose inputs are those that it declares."""
    declared = node.INPUT_TYPES()
    assert (
        declared["required"].keys()
        <= inputs.keys()
        <= {**declared["required"], **declared.get("optional", {})}.keys()
    )
    done = getattr(node(), node.FUNCTION)(**inputs)
    results = done["result"] if isinstance(done, dict) else done
    assert len(results) == len(node.RETURN_TYPES) == len(node.RETURN_NAMES)
    return results


def test_a_mesh_goes_from_file_to_file(comfy, nodes):
    ball = trimesh.creation.icosphere(4)
    ball.visual.vertex_colors = np.where(ball.vertices[:, :1] > 0, [255, 0, 0, 255], [0, 0, 255, 255])
    ball.export(comfy.folder / "input/ball.ply")
    assert nodes["RtfmeshLoad"].INPUT_TYPES()["required"]["file"] == (["ball.ply"],)
    [mesh] = call(nodes["RtfmeshLoad"], file="ball.ply")
    mesh, report = call(nodes["RtfmeshRemesh"], mesh=mesh, vertices=500, quality="draft")
    assert len(mesh.vertices) == json.loads(report)["output"]["topology"]["vertices"] == 500
    assert comfy.bar == sorted(comfy.bar) and comfy.bar[-1] == 100
    paths = [call(nodes["RtfmeshSave"], mesh=mesh, prefix="ball", format="glb")[0] for _ in range(2)]
    assert len(set(paths)) == 2
    again = trimesh.load_mesh(paths[0])
    assert len(again.faces) == 996 and "rtfmesh" not in again.metadata
    right = again.visual.vertex_colors[again.vertices[:, 0] > 0.2]
    assert (right == [255, 0, 0, 255]).all()


def test_options_reach_the_run(comfy, nodes):
    box = trimesh.creation.box()
    options = {"feature_angle": 180.0, "sizing": "uniform", "keep_uv": True, "seed": 7}
    _, report = call(nodes["RtfmeshRemesh"], mesh=box, vertices=300, quality="best", **options)
    report = json.loads(report)
    assert report["features"]["corners"] == 0
    assert report["options"]["seed"] == 7


def test_a_stopped_workflow_ends_in_the_way_of_comfyui(comfy, nodes):
    comfy.stop = True
    ball = trimesh.creation.icosphere(5)
    with pytest.raises(Interrupted):
        call(nodes["RtfmeshRemesh"], mesh=ball, vertices=20_000, quality="best")


def test_only_files_of_the_input_folder_are_loaded(comfy, nodes):
    trimesh.creation.box().export(comfy.folder / "secret.ply")
    for file in ("../secret.ply", str(comfy.folder / "secret.ply"), "missing.ply"):
        with pytest.raises(ValueError, match="input folder"):
            call(nodes["RtfmeshLoad"], file=file)


def test_a_file_is_loaded_again_after_a_change(comfy, nodes):
    path = comfy.folder / "input/box.stl"
    trimesh.creation.box().export(path)
    first = nodes["RtfmeshLoad"].IS_CHANGED("box.stl")
    assert nodes["RtfmeshLoad"].IS_CHANGED("box.stl") == first
    path.touch()
    assert nodes["RtfmeshLoad"].IS_CHANGED("box.stl") != first


def test_without_comfyui_there_is_no_bar_and_errors_are_those_of_the_package(nodes):
    box = trimesh.creation.box()
    box.faces = box.faces[:0]
    with pytest.raises(rtfmesh.InputError, match="`faces` is empty"):
        call(nodes["RtfmeshRemesh"], mesh=box, vertices=300, quality="draft")
