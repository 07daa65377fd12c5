//! The parts of a glTF document that define triangles.

use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;

use crate::io::checks::excerpt;
use crate::{Error, Result};

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Model {
    asset: Asset,
    pub scene: Option<usize>,
    #[serde(default)]
    pub scenes: Vec<Scene>,
    #[serde(default)]
    pub nodes: Vec<Node>,
    #[serde(default)]
    pub meshes: Vec<Mesh>,
    #[serde(default)]
    pub accessors: Vec<Accessor>,
    #[serde(default)]
    pub buffer_views: Vec<BufferView>,
    #[serde(default)]
    pub buffers: Vec<Buffer>,
    #[serde(default)]
    pub materials: Vec<Material>,
    /// Not of a type that would refuse what only materials need.
    #[serde(default)]
    images: Value,
    #[serde(default)]
    extensions_required: Vec<String>,
    #[serde(default)]
    extensions_used: Vec<String>,
}

#[derive(Deserialize)]
struct Asset {
    version: String,
}

#[derive(Deserialize)]
pub(crate) struct Scene {
    #[serde(default)]
    pub nodes: Vec<usize>,
}

/// Small, since three characters of JSON are a node.
#[derive(Deserialize)]
pub(crate) struct Node {
    #[serde(default)]
    pub children: Vec<usize>,
    pub mesh: Option<usize>,
    pub skin: Option<usize>,
    /// By columns; replaces the three below.
    pub matrix: Option<Box<[f64; 16]>>,
    pub translation: Option<Box<[f64; 3]>>,
    /// x, y, z, w.
    pub rotation: Option<Box<[f64; 4]>>,
    pub scale: Option<Box<[f64; 3]>>,
}

#[derive(Deserialize)]
pub(crate) struct Mesh {
    #[serde(default)]
    pub primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(crate) struct Primitive {
    pub attributes: Attributes,
    pub indices: Option<usize>,
    pub mode: Option<u32>,
    pub material: Option<usize>,
    /// Morph targets; `IgnoredAny` keeps none of their data.
    #[serde(default)]
    pub targets: Vec<IgnoredAny>,
}

#[derive(Deserialize)]
pub(crate) struct Material {
    pub name: Option<String>,
}

#[derive(Deserialize)]
pub(crate) struct Attributes {
    #[serde(rename = "POSITION")]
    pub position: Option<usize>,
    #[serde(rename = "COLOR_0")]
    pub colour: Option<usize>,
    #[serde(rename = "NORMAL")]
    pub normal: Option<usize>,
    #[serde(rename = "TEXCOORD_0")]
    pub uv: Option<usize>,
    #[serde(rename = "JOINTS_0")]
    pub joints: Option<usize>,
    #[serde(rename = "WEIGHTS_0")]
    pub weights: Option<usize>,
    /// Of vertices with more than four joints.
    #[serde(rename = "JOINTS_1")]
    pub further_joints: Option<usize>,
    #[serde(rename = "WEIGHTS_1")]
    pub further_weights: Option<usize>,
    /// Of vertices with more than eight.
    #[serde(rename = "JOINTS_2")]
    ignored_joints: Option<IgnoredAny>,
}

impl Attributes {
    /// The accessors that vertices come from, apart from texture coordinates, which count for corners.
    pub fn of_vertices(&self) -> [Option<usize>; 7] {
        let [first, second] = self.influences();
        [self.position, self.colour, self.normal, first.0, first.1, second.0, second.1]
    }

    /// Whether vertices have sets of joints beyond those of [`Attributes::influences`]. Sets are numbered
    /// without gaps.
    pub fn has_ignored_joints(&self) -> bool {
        self.ignored_joints.is_some()
    }

    /// The first two sets of joints and their weights.
    pub fn influences(&self) -> [(Option<usize>, Option<usize>); 2] {
        [(self.joints, self.weights), (self.further_joints, self.further_weights)]
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: usize,
    #[serde(rename = "type")]
    pub kind: String,
    pub sparse: Option<Box<Sparse>>,
}

/// Elements that replace some of an accessor's.
#[derive(Deserialize)]
pub(crate) struct Sparse {
    pub count: usize,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SparseIndices {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SparseValues {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: usize,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct BufferView {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Buffer {
    pub uri: Option<String>,
    pub byte_length: usize,
}

impl Model {
    /// The images of all materials.
    pub fn image_count(&self) -> usize {
        self.images.as_array().map_or(0, Vec::len)
    }

    /// Whether an extension may make copies of meshes, which are not read.
    pub fn has_copies(&self) -> bool {
        self.extensions_used.iter().any(|name| name == "EXT_mesh_gpu_instancing")
    }

    /// Refuses other versions, and required extensions that may define triangles.
    pub fn check(&self) -> Result<()> {
        if self.asset.version.split('.').next() != Some("2") {
            let problem = format!("this is glTF version {}, not 2", excerpt(&self.asset.version));
            return Err(Error::input(Some("asset".to_owned()), problem, "export the mesh again as glTF 2.0"));
        }
        // Extensions for materials, lights and data about the file do not affect triangles.
        let harmless = |name: &String| {
            let starts = [
                "KHR_materials_",
                "KHR_texture_",
                "EXT_texture_",
                "KHR_lights_",
                "EXT_lights_",
                "KHR_xmp",
                "KHR_animation_pointer",
                "EXT_mesh_features",
                "EXT_structural_metadata",
            ];
            name == "KHR_mesh_quantization" || starts.iter().any(|start| name.starts_with(start))
        };
        if let Some(name) = self.extensions_required.iter().find(|name| !harmless(name)) {
            let place = Some("extensionsRequired".to_owned());
            let problem = format!("the extension '{}' is not supported", excerpt(name));
            return Err(Error::input(
                place,
                problem,
                "export the mesh again without compression or extensions",
            ));
        }
        Ok(())
    }
}
