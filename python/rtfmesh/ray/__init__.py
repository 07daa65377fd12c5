"""Remeshes all meshes of a list on a Ray cluster, or on the cores and GPUs of one machine.

    from rtfmesh.ray import remesh_manifest

    summary = remesh_manifest("meshes.csv", "remeshed", n=10_000)

`python -m rtfmesh.ray meshes.csv remeshed -n 10k` does the same.
"""

from ._pipeline import Summary, remesh_manifest

__all__ = ["Summary", "remesh_manifest"]
