"""The settings that the panel and the operator share."""

import math

from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty
from bpy.types import PropertyGroup


class Settings:
    """The declarations of all settings."""

    size: EnumProperty(
        name="Size",
        description="How the size of the result is given",
        items=[
            ("VERTICES", "Vertices", "Exact number of vertices"),
            ("FACES", "Faces", "Number of triangles; one or two fewer if the surface does not allow it"),
            ("EDGE_LENGTH", "Edge Length", "Target edge length, with the object's scale applied"),
            ("RATIO", "Ratio", "Number of vertices as a fraction of the present one"),
            ("DEVIATION", "Deviation", "Maximum distance from the present surface; takes several runs"),
        ],
        default="VERTICES",
    )
    vertices: IntProperty(name="Vertices", default=5000, min=4, max=2**31 - 1, soft_max=1_000_000)
    faces: IntProperty(name="Faces", default=10_000, min=4, max=2**31 - 1, soft_max=2_000_000)
    edge_length: FloatProperty(
        name="Edge Length", default=0.1, min=1e-9, soft_min=1e-3, precision=4, unit="LENGTH"
    )
    ratio: FloatProperty(name="Ratio", default=0.5, min=1e-6, soft_max=2, max=1000)
    deviation: FloatProperty(
        name="Deviation",
        description="Maximum distance from the present surface, in percent of the bounding box's diagonal",
        default=0.1,
        min=1e-4,
        max=50,
        precision=3,
        subtype="PERCENTAGE",
    )
    quality: EnumProperty(
        name="Quality",
        items=[
            ("DRAFT", "Draft", "Fast"),
            ("NORMAL", "Normal", "For most uses"),
            ("BEST", "Best", "Slow, with the most even triangles"),
        ],
        default="NORMAL",
    )
    sizing: EnumProperty(
        name="Edge Lengths",
        items=[
            ("AUTO", "Auto", "Equal, but shorter around details that equal edges would miss"),
            ("UNIFORM", "Uniform", "Equal everywhere"),
            ("CURVATURE", "Curvature", "Shorter where the surface is curved"),
            ("GROUP", "Vertex Group", "Shorter where a vertex group has weight"),
        ],
        default="AUTO",
    )
    density_group: StringProperty(name="Density", description="Vertex group whose weight makes edges shorter")
    density: FloatProperty(
        name="Factor",
        description="By how much edges are shorter at weight 1",
        default=4,
        min=1,
        max=100,
        soft_max=10,
    )
    feature_angle: FloatProperty(
        name="Feature Angle",
        description="Keep edges at which the surface turns by more than this; 180° keeps none",
        default=math.radians(40),
        min=0,
        max=math.pi,
        subtype="ANGLE",
    )
    keep_sharp: BoolProperty(
        name="Marked Edges",
        description="Keep edges that are marked sharp or have a crease or bevel weight",
        default=True,
    )
    keep_seams: BoolProperty(
        name="Seams",
        description="Keep seams and the borders of UV islands, so that textures stay as they are",
        default=True,
    )
    keep_materials: BoolProperty(
        name="Material Borders", description="Keep the borders between materials", default=True
    )
    keep_boundary: BoolProperty(
        name="Boundary Vertices",
        description="Keep vertices and edges of open boundaries exactly, so that adjacent meshes still fit",
        default=False,
    )
    apply_modifiers: BoolProperty(
        name="Apply Modifiers",
        description="Remesh what the modifiers show, and remove them. Otherwise the mesh below the modifiers "
        "is remeshed, and they stay",
        default=False,
    )
    as_copy: BoolProperty(
        name="As Copy", description="Leave the object as it is and remesh a copy", default=False
    )


class RtfmeshSettings(Settings, PropertyGroup):
    """The settings of the panel."""


def options(settings):
    """The keyword arguments of `rtfmesh.remesh` for these settings, except arrays of a mesh."""
    size = {
        "VERTICES": {"n": settings.vertices},
        "FACES": {"n_faces": settings.faces},
        "EDGE_LENGTH": {"edge_length": settings.edge_length},
        "RATIO": {"ratio": settings.ratio},
        "DEVIATION": {"max_deviation": f"{settings.deviation:.6g}%"},
    }[settings.size]
    found = {
        **size,
        "quality": settings.quality.lower(),
        "feature_angle": round(math.degrees(settings.feature_angle), 4),
        "keep_boundary": settings.keep_boundary,
    }
    # With a limit on the distance, that chooses edge lengths unless others are asked for.
    if settings.sizing not in ("AUTO", "GROUP"):
        found["sizing"] = settings.sizing.lower()
    return found


def draw(layout, settings, mesh_object=None):
    """Draws all settings: those of the panel, or of the operator that can be repeated."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(settings, "size")
    layout.prop(settings, settings.size.lower())
    layout.prop(settings, "quality")
    layout.prop(settings, "sizing")
    if settings.sizing == "GROUP":
        if mesh_object:
            layout.prop_search(settings, "density_group", mesh_object, "vertex_groups")
        else:
            layout.prop(settings, "density_group")
        layout.prop(settings, "density")
    layout.prop(settings, "feature_angle")
    column = layout.column(heading="Keep")
    for name in ("keep_sharp", "keep_seams", "keep_materials", "keep_boundary"):
        column.prop(settings, name)
    column = layout.column(heading="Object")
    column.prop(settings, "apply_modifiers")
    column.prop(settings, "as_copy")
