//! Reads skins: which joints move each vertex, and the skeleton that the joints belong to.
//!
//! All skins of a scene become one, since its meshes become one. A mesh without a skin moves with its own
//! node, which becomes a joint as well.

use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DMat4, DVec3};
use serde::Deserialize;
use serde::de::IgnoredAny;

use super::accessors::Buffers;
use super::animations::{AnimationEntry, AnimationReader};
use super::attributes::vertex_elements;
use super::model::{Model, Node, Primitive};
use super::scene::visit_nodes;
use crate::grammar::counted;
use crate::io::checks::{excerpt, outgrows};
use crate::mesh::NONE;
use crate::mesh::attributes::{Bone, Influences, Kind, Skeleton, Skin};
use crate::{Error, Result};

/// Vertices name joints by 16 bits.
const MOST_JOINTS: usize = 1 << 16;
/// Bind matrices have 32-bit numbers, so transforms that differ from the identity by less are rounding.
const ROUNDING: f64 = 1e-5;
/// What a node takes with its transform, its bone and its joint.
const NODE_BYTES: usize = 400;

/// What was read, or what is wrong with it for a note.
type Attempt<T> = std::result::Result<T, String>;

/// What triangles do without.
#[derive(Deserialize, Default)]
struct Document {
    #[serde(default)]
    nodes: Vec<NodeEntry>,
    #[serde(default)]
    skins: Vec<SkinEntry>,
    #[serde(default)]
    animations: Vec<AnimationEntry>,
}

#[derive(Deserialize)]
struct NodeEntry {
    name: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct SkinEntry {
    joints: Vec<usize>,
    inverse_bind_matrices: Option<usize>,
}

/// Where a node is in the scene.
#[derive(Clone, Copy)]
struct Placed {
    parent: Option<usize>,
    to_scene: DAffine3,
}

/// What moves the mesh of a node.
#[derive(Clone)]
enum Binding {
    /// One joint of the result.
    Rigid(u16),
    /// For each joint of the file's skin, that of the result.
    Skinned(Rc<Vec<u16>>),
}

/// The skin of the result so far.
pub(crate) struct SkinReader<'a> {
    model: &'a Model,
    buffers: &'a Buffers<'a>,
    document: Document,
    placed: Vec<Option<Placed>>,
    /// The nodes of the scene, parents before their children.
    order: Vec<usize>,
    /// The node of each joint.
    joints: Vec<usize>,
    inverse_bind: Vec<DAffine3>,
    /// Joints by their nodes and the bits of their matrices.
    known_joints: HashMap<(usize, [u32; 12]), u16>,
    /// By the numbers of skins in the file; with the transform from vertices to the scene.
    known_skins: HashMap<usize, (DAffine3, Binding)>,
    /// Of the node whose vertices are read.
    binding: Binding,
    vertices: Vec<Influences>,
    /// Vertices with more joints than are kept.
    shortened: usize,
    /// Vertices with more joints than are read.
    unread: usize,
    /// Why there will be no skin.
    problem: Option<String>,
}

impl<'a> SkinReader<'a> {
    /// `None` if no mesh has a skin.
    pub fn new(model: &'a Model, buffers: &'a Buffers<'a>, json: &[u8]) -> Result<Option<Self>> {
        if !model.nodes.iter().any(|node| node.mesh.is_some() && node.skin.is_some()) {
            return Ok(None);
        }
        let mut reader = Self {
            model,
            buffers,
            document: Document::default(),
            placed: Vec::new(),
            order: Vec::new(),
            joints: Vec::new(),
            inverse_bind: Vec::new(),
            known_joints: HashMap::new(),
            known_skins: HashMap::new(),
            binding: Binding::Rigid(0),
            vertices: Vec::new(),
            shortened: 0,
            unread: 0,
            problem: None,
        };
        if outgrows((NODE_BYTES * model.nodes.len()) as u64, json.len() as u64) {
            reader.give_up("the file has too many nodes for its size".to_owned());
            return Ok(Some(reader));
        }
        reader.placed = vec![None; model.nodes.len()];
        let mut any = false;
        visit_nodes(model, |index, node, parent, transform| {
            if let Some(place) = reader.placed.get_mut(index) {
                *place = Some(Placed { parent, to_scene: DAffine3::from_mat4(transform) });
            }
            reader.order.push(index);
            any |= node.mesh.is_some() && node.skin.is_some();
            Ok(())
        })?;
        match serde_json::from_slice(json) {
            Ok(document) => reader.document = document,
            Err(error) => reader.give_up(excerpt(&error.to_string())),
        }
        Ok(any.then_some(reader))
    }

    /// Starts the mesh of a node; returns the transform from its vertices to the scene. That of a skinned
    /// node itself does not count.
    pub fn start_mesh(&mut self, index: usize, node: &Node, transform: DMat4) -> DMat4 {
        if self.problem.is_some() {
            return transform;
        }
        let bound = match node.skin {
            Some(skin) => self.bind_skin(skin),
            None => self.bind_rigid(index, transform),
        };
        match bound {
            Ok((to_scene, binding)) => {
                self.binding = binding;
                if node.skin.is_some() { DMat4::from(to_scene) } else { transform }
            }
            Err(problem) => {
                self.give_up(problem);
                transform
            }
        }
    }

    fn bind_rigid(&mut self, index: usize, transform: DMat4) -> Attempt<(DAffine3, Binding)> {
        let to_scene = DAffine3::from_mat4(transform);
        let back = inverse(to_scene).ok_or_else(|| format!("the scale of node {index} is 0"))?;
        Ok((to_scene, Binding::Rigid(self.joint(index, back)?)))
    }

    fn bind_skin(&mut self, skin: usize) -> Attempt<(DAffine3, Binding)> {
        if let Some(known) = self.known_skins.get(&skin) {
            return Ok(known.clone());
        }
        let place = |problem: String| format!("skin {skin}: {problem}");
        let Some(entry) = self.document.skins.get_mut(skin) else {
            return Err(format!("there is no skin {skin}"));
        };
        let (nodes, accessor) = (std::mem::take(&mut entry.joints), entry.inverse_bind_matrices);
        if nodes.len() > MOST_JOINTS {
            return Err(place(format!("it has more than {MOST_JOINTS} joints")));
        }
        let inverse_bind = self.inverse_bind_matrices(accessor, nodes.len()).map_err(place)?;
        let (mut first, mut size) = (None, 0.0_f64);
        for (node, matrix) in nodes.iter().zip(&inverse_bind) {
            let Some(Some(placed)) = self.placed.get(*node) else {
                return Err(place(format!("its joint, node {node}, is not in the scene")));
            };
            first.get_or_insert(placed.to_scene * *matrix);
            size = size.max(placed.to_scene.translation.length());
        }
        // Where the joints are in the pose of the skin, this takes vertices to where viewers show them.
        let first = first.ok_or_else(|| place("it has no joints".to_owned()))?;
        let to_scene = without_rounding(first, size);
        let (to_scene, back) = match inverse(to_scene) {
            Some(back) => (to_scene, back),
            None => (DAffine3::IDENTITY, DAffine3::IDENTITY),
        };
        let joints = nodes.iter().zip(inverse_bind).map(|(node, matrix)| self.joint(*node, matrix * back));
        let binding = Binding::Skinned(Rc::new(joints.collect::<Attempt<_>>()?));
        self.known_skins.insert(skin, (to_scene, binding.clone()));
        Ok((to_scene, binding))
    }

    fn inverse_bind_matrices(&self, accessor: Option<usize>, count: usize) -> Attempt<Vec<DAffine3>> {
        let Some(accessor) = accessor else { return Ok(vec![DAffine3::IDENTITY; count]) };
        let elements = self.buffers.elements(accessor, "MAT4").map_err(said)?;
        if elements.count < count {
            let elements = counted(elements.count, ["element", "elements"]);
            let joints = counted(count, ["joint", "joints"]);
            return Err(format!("accessor {accessor} has {elements} for {joints}"));
        }
        let matrix = |index: usize| {
            let column =
                |k: usize| DVec3::from_array([0, 1, 2].map(|row| elements.number(index, 4 * k + row)));
            DAffine3::from_cols(column(0), column(1), column(2), column(3))
        };
        Ok((0..count).map(matrix).collect())
    }

    /// The number of the joint in the result.
    fn joint(&mut self, node: usize, inverse_bind: DAffine3) -> Attempt<u16> {
        let numbers = inverse_bind.to_cols_array().map(|x| x as f32);
        if !numbers.iter().all(|x| x.is_finite()) {
            return Err(format!("the bind matrix of joint {node} is not finite"));
        }
        let key = (node, numbers.map(f32::to_bits));
        if let Some(known) = self.known_joints.get(&key) {
            return Ok(*known);
        }
        let Ok(number) = u16::try_from(self.joints.len()) else {
            return Err(format!("the meshes have more than {MOST_JOINTS} joints together"));
        };
        self.joints.push(node);
        self.inverse_bind.push(inverse_bind);
        self.known_joints.insert(key, number);
        Ok(number)
    }

    /// Reads the joints and weights of a primitive of the started mesh.
    pub fn read_vertices(&mut self, primitive: &Primitive, count: usize, place: &str) {
        if self.problem.is_some() {
            return;
        }
        match self.binding.clone() {
            Binding::Rigid(joint) => {
                self.vertices.extend(std::iter::repeat_n(Influences::rigid(joint), count));
            }
            Binding::Skinned(joints) => {
                if let Err(problem) = self.read_influences(primitive, &joints, count, place) {
                    self.give_up(format!("{place}: {problem}"));
                }
            }
        }
    }

    fn read_influences(
        &mut self,
        primitive: &Primitive,
        numbers: &[u16],
        count: usize,
        place: &str,
    ) -> Attempt<()> {
        let (buffers, mut sets) = (self.buffers, Vec::new());
        for (k, (joints, weights)) in primitive.attributes.influences().into_iter().enumerate() {
            let (Some(joints), Some(weights)) = (joints, weights) else {
                if k == 0 {
                    return Err("it has a skin, and no joints or weights".to_owned());
                }
                continue;
            };
            let read = |accessor| vertex_elements(buffers, accessor, "VEC4", count, place).map_err(said);
            let (joints, weights) = (read(joints)?, read(weights)?);
            if !matches!(joints.component, Kind::U8 | Kind::U16 | Kind::U32) {
                return Err("its joints are not unsigned integers".to_owned());
            }
            sets.push((joints, weights));
        }
        if primitive.attributes.has_ignored_joints() {
            self.unread += count;
        }
        let mut parts: Vec<(u16, f64)> = Vec::with_capacity(8);
        for v in 0..count {
            parts.clear();
            for ((joints, weights), k) in sets.iter().flat_map(|set| (0..4).map(move |k| (set, k))) {
                let (joint, weight) = (joints.number(v, k), weights.number(v, k));
                if !(0.0..=f64::from(f32::MAX)).contains(&weight) {
                    return Err(format!("the weights of vertex {v} are not valid"));
                }
                match numbers.get(joint as usize) {
                    Some(number) => parts.push((*number, weight)),
                    // Nothing says which joint a weight of 0 has to have.
                    None if weight == 0.0 => {}
                    None => {
                        return Err(format!(
                            "vertex {v} refers to joint {joint}; joints count from 0, and the skin has {}",
                            numbers.len()
                        ));
                    }
                }
            }
            parts.retain(|(_, weight)| *weight > 0.0);
            let is_first = |k: &usize| !parts[..*k].iter().any(|(joint, _)| *joint == parts[*k].0);
            self.shortened += usize::from((0..parts.len()).filter(is_first).count() > 4);
            // Viewers let vertices without weights follow their first joint.
            let unmoved = || {
                let first = sets.first().and_then(|(joints, _)| numbers.get(joints.number(v, 0) as usize));
                Influences::rigid(first.or(numbers.first()).copied().unwrap_or_default())
            };
            let found = Influences::combined(parts.iter().copied());
            self.vertices.push(found.unwrap_or_else(unmoved));
        }
        Ok(())
    }

    fn give_up(&mut self, problem: String) {
        self.problem = Some(problem);
        self.vertices = Vec::new();
    }

    /// Bytes of what is gathered.
    pub fn bytes(&self) -> usize {
        size_of::<Influences>() * self.vertices.len()
    }

    /// The skin of all vertices with its skeleton; notes say what is left out. `bytes` were read so far.
    pub fn finish(mut self, bytes: usize, notes: &mut Vec<String>) -> Option<Skin> {
        if let Some(problem) = &self.problem {
            notes.push(format!("skins were left out, and meshes are in their rest pose: {problem}"));
            return None;
        }
        if self.shortened > 0 {
            let vertices = counted(self.shortened, ["vertex follows", "vertices follow"]);
            notes.push(format!("{vertices} more than four joints; those with the largest weights are kept"));
        }
        if self.unread > 0 {
            let vertices = counted(self.unread, ["vertex has", "vertices have"]);
            notes
                .push(format!("{vertices} more than two sets of four joints; the further sets were ignored"));
        }
        let (mut bones, bone_of) = self.bones();
        let mut animations = AnimationReader::new(self.buffers, bytes);
        for (index, entry) in std::mem::take(&mut self.document.animations).into_iter().enumerate() {
            if let Err(problem) = animations.read(entry, &bone_of) {
                notes.push(format!("animation {index} was left out: {problem}"));
            }
        }
        let (animations, tracks) = animations.finish();
        let joints = own_bones(&mut bones, self.joints.iter().filter_map(|node| bone_of.get(*node).copied()));
        let skeleton = Skeleton { bones, joints, inverse_bind: self.inverse_bind, animations, tracks };
        Some(Skin { vertices: self.vertices, skeleton: Arc::new(skeleton) })
    }

    /// Joints with all nodes above and below them, and the bone of each node.
    fn bones(&mut self) -> (Vec<Bone>, Vec<u32>) {
        let mut kept = vec![false; self.placed.len()];
        let parent = |node: usize| self.placed.get(node).and_then(|placed| (*placed)?.parent);
        self.joints.iter().for_each(|joint| kept[*joint] = true);
        for node in &self.order {
            kept[*node] |= parent(*node).is_some_and(|parent| kept[parent]);
        }
        for node in self.order.iter().rev() {
            if let Some(parent) = parent(*node) {
                kept[parent] |= kept[*node];
            }
        }
        let (mut bones, mut bone_of) = (Vec::new(), vec![NONE; kept.len()]);
        for index in self.order.iter().copied().filter(|node| kept[*node]) {
            let Some(node) = self.model.nodes.get(index) else { continue };
            bone_of[index] = bones.len() as u32;
            bones.push(Bone {
                name: self.document.nodes.get_mut(index).and_then(|entry| entry.name.take()),
                parent: parent(index).map(|parent| bone_of[parent]),
                matrix: node.matrix.clone(),
                translation: node.translation.clone(),
                rotation: node.rotation.clone(),
                scale: node.scale.clone(),
            });
        }
        (bones, bone_of)
    }
}

/// A bone for each joint. glTF has a node once among the joints of a skin, so where several skins have bound
/// the same node differently, the further ones get nodes below it that do not move relative to it.
fn own_bones(bones: &mut Vec<Bone>, wanted: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut is_taken = vec![false; bones.len()];
    let mut own = |bone: u32| {
        if !std::mem::replace(&mut is_taken[bone as usize], true) {
            return bone;
        }
        bones.push(Bone { parent: Some(bone), ..Bone::default() });
        bones.len() as u32 - 1
    };
    wanted.map(&mut own).collect()
}

/// How many animations the file has; none if they are not valid.
pub(super) fn animation_count(json: &[u8]) -> usize {
    #[derive(Deserialize)]
    struct Animated {
        // `IgnoredAny` keeps none of their data.
        #[serde(default)]
        animations: Vec<IgnoredAny>,
    }
    serde_json::from_slice(json).map_or(0, |found: Animated| found.animations.len())
}

/// The inverse, if there is one.
fn inverse(transform: DAffine3) -> Option<DAffine3> {
    let back = transform.inverse();
    (transform.is_finite() && back.is_finite() && transform.matrix3.determinant() != 0.0).then_some(back)
}

/// The identity in place of a transform that only rounding makes different. `size` is that of the skeleton.
fn without_rounding(transform: DAffine3, size: f64) -> DAffine3 {
    let turns = transform.matrix3 - DMat3::IDENTITY;
    let is_rounding = turns.to_cols_array().iter().all(|x| x.abs() <= ROUNDING)
        && transform.translation.length() <= ROUNDING * size;
    if is_rounding { DAffine3::IDENTITY } else { transform }
}

/// What is wrong, as a part of a note.
pub(super) fn said(error: Error) -> String {
    match error {
        Error::Input { place: Some(place), problem, .. } => format!("{place}: {problem}"),
        Error::Input { problem, .. } => problem,
        other => other.to_string(),
    }
}
