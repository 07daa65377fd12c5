//! Writes the skin, the skeleton and the animations of a `.glb` file.

use glam::{DAffine3, DMat3, DMat4, DVec3};
use serde_json::{Value, json};

use super::write::{BufferBuilder, NodeTransform};
use crate::mesh::attributes::{Animation, Bone, Influences, Skeleton, Skin, Track};

/// Maximum number of bytes of a bone in JSON without its name: the numbers of a matrix, keys, and the number
/// of a child.
const BONE_BYTES: usize = 600;
const CHANNEL_BYTES: usize = 200;
/// Maximum number of bytes of an accessor in JSON with its buffer view.
const ACCESSOR_BYTES: usize = 300;

/// Bytes of the influences on a vertex.
pub(crate) const VERTEX_BYTES: u64 = size_of::<Influences>() as u64;

/// The parts of the document that a skin adds.
pub(crate) struct SkinParts {
    /// They come after the node of the mesh.
    nodes: Vec<Value>,
    /// The index of the node above all others.
    root: usize,
    skin: Value,
    animations: Vec<Value>,
}

/// Upper bound for the bytes of the skeleton and its animations, in the buffer and in JSON.
pub(crate) fn byte_length(skin: &Skin) -> u64 {
    let Skeleton { bones, joints, animations, tracks, .. } = skin.skeleton.as_ref();
    // Each byte of a name takes up to six in JSON.
    let named = |name: &Option<String>| 6 * name.as_ref().map_or(0, String::len);
    let bones: usize = bones.iter().map(|bone| BONE_BYTES + named(&bone.name)).sum();
    let animation = |a: &Animation| named(&a.name) + CHANNEL_BYTES * (1 + a.channels.len());
    let animations: usize = animations.iter().map(animation).sum();
    let tracks: usize = tracks.iter().map(|track| ACCESSOR_BYTES + 4 * track.values.len()).sum();
    (bones + animations + tracks + (64 + 12) * joints.len()) as u64
}

/// Adds the skin's numbers to the buffer. `transform` takes positions in the buffer to those of the mesh;
/// readers do not apply it to a skinned mesh, so the bind matrices have it.
pub(crate) fn skin_parts(skin: &Skin, transform: &NodeTransform, buffer: &mut BufferBuilder) -> SkinParts {
    let skeleton = skin.skeleton.as_ref();
    // The mesh is node 0.
    let node_of = |bone: u32| bone as usize + 1;
    let mut children = vec![Vec::new(); skeleton.bones.len()];
    let mut roots = Vec::new();
    for (number, bone) in (0..).zip(&skeleton.bones) {
        let siblings = bone.parent.and_then(|parent| children.get_mut(parent as usize));
        siblings.unwrap_or(&mut roots).push(node_of(number));
    }
    let mut nodes: Vec<Value> = skeleton.bones.iter().zip(children).map(bone_node).collect();
    let root = match *roots {
        [root] => root,
        // The joints of a skin must have a root in common.
        _ => {
            nodes.push(json!({ "name": "skeleton", "children": roots }));
            nodes.len()
        }
    };
    let to_mesh = DAffine3 {
        matrix3: DMat3::from_diagonal(DVec3::splat(transform.scale)),
        translation: transform.translation,
    };
    let bind = |matrix: &DAffine3| DMat4::from(*matrix * to_mesh).to_cols_array().map(|x| x as f32);
    let matrices = buffer.add_floats(skeleton.inverse_bind.iter().map(bind), false, None);
    let joints: Vec<usize> = skeleton.joints.iter().map(|bone| node_of(*bone)).collect();
    let tracks: Vec<usize> = skeleton.tracks.iter().map(|track| add_track(buffer, track)).collect();
    let animation = |animation: &Animation| {
        let channels = animation.channels.iter().enumerate().map(|(sampler, channel)| {
            let target = json!({ "node": node_of(channel.bone), "path": channel.path });
            json!({ "sampler": sampler, "target": target })
        });
        let samplers = animation.channels.iter().map(|channel| {
            let [input, output] = [channel.times, channel.values].map(|track| tracks.get(track));
            json!({ "input": input, "output": output, "interpolation": channel.interpolation })
        });
        let (channels, samplers): (Vec<Value>, Vec<Value>) = (channels.collect(), samplers.collect());
        with_name(json!({ "channels": channels, "samplers": samplers }), animation.name.as_deref())
    };
    let animations = skeleton.animations.iter().map(animation).collect();
    SkinParts { nodes, root, skin: json!({ "joints": joints, "inverseBindMatrices": matrices }), animations }
}

/// Adds the parts to a document whose only node is that of the mesh.
pub(crate) fn add_parts(document: &mut Value, parts: SkinParts) {
    let mut nodes = vec![document["nodes"][0].take()];
    nodes.extend(parts.nodes);
    document["nodes"] = Value::Array(nodes);
    document["scenes"] = json!([{ "nodes": [0, parts.root] }]);
    document["skins"] = json!([parts.skin]);
    if !parts.animations.is_empty() {
        document["animations"] = Value::Array(parts.animations);
    }
}

fn bone_node((bone, children): (&Bone, Vec<usize>)) -> Value {
    let mut node = with_name(json!({}), bone.name.as_deref());
    if !children.is_empty() {
        node["children"] = json!(children);
    }
    if let Some(matrix) = &bone.matrix {
        node["matrix"] = json!(matrix.as_slice());
        return node;
    }
    if let Some(translation) = &bone.translation {
        node["translation"] = json!(translation.as_slice());
    }
    if let Some(rotation) = &bone.rotation {
        node["rotation"] = json!(rotation.as_slice());
    }
    if let Some(scale) = &bone.scale {
        node["scale"] = json!(scale.as_slice());
    }
    node
}

fn with_name(mut value: Value, name: Option<&str>) -> Value {
    if let Some(name) = name {
        value["name"] = json!(name);
    }
    value
}

/// Adds a track to the buffer; returns its accessor. Times need bounds.
fn add_track(buffer: &mut BufferBuilder, track: &Track) -> usize {
    match track.components {
        1 => buffer.add_floats(track.values.iter().map(|value| [*value]), true, None),
        3 => buffer.add_floats(track.values.as_chunks::<3>().0.iter().copied(), false, None),
        _ => buffer.add_floats(track.values.as_chunks::<4>().0.iter().copied(), false, None),
    }
}
