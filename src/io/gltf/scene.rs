//! Merges the triangles of the default scene, in its coordinates, or the points of a scene without triangles.

use std::collections::HashMap;

use glam::{DMat4, DQuat, DVec3, DVec4};

use super::accessors::Buffers;
use super::attributes::AttributeReader;
use super::model::{Model, Node, Primitive};
use super::skins::{SkinReader, animation_count};
use crate::grammar::counted;
use crate::io::checks::{check_counts, check_vertex_count, outgrows};
use crate::io::loaded::Loaded;
use crate::mesh::attributes::{Attributes, Influences};
use crate::{Error, Result, TriMesh, WarningCode};

/// Maximum number of bytes that a vertex or a triangle takes with its attributes.
const VERTEX_BYTES: usize = 24 + 64 + 48;
const TRIANGLE_BYTES: usize = 12 + 48 + 8;
const POINTS: u32 = 0;
const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

/// Primitives that any scene may have.
const MOST_PRIMITIVES: u64 = 1 << 17;

fn repeat_error(place: &str) -> Error {
    let problem = "the scene repeats its meshes too often";
    Error::input(Some(place.to_owned()), problem, "write fewer copies of them")
}

fn scene_error(place: String, problem: impl Into<String>) -> Error {
    Error::input(Some(place), problem, "export the mesh again")
}

/// The default scene as one mesh. The bytes read so far limit how often meshes may be repeated. `model` was
/// read from `json`.
pub(crate) fn merge_scene<'a>(model: &'a Model, buffers: &'a Buffers<'a>, json: &[u8]) -> Result<Loaded> {
    let mut merged = SceneMerger::merge(model, buffers, Some(json))?;
    let has_triangles = !merged.mesh.triangles.is_empty();
    if !has_triangles && merged.has_points {
        merged = SceneMerger::merge(model, buffers, None)?;
        check_vertex_count(merged.mesh.vertices.len() as u64)?;
    } else {
        check_counts(merged.mesh.vertices.len() as u64, merged.mesh.triangles.len() as u64)?;
    }
    let (size, mesh) = (merged.size(), merged.mesh);
    let mut notes = Vec::new();
    if merged.ignored_primitives > 0 {
        let primitives = if has_triangles {
            ["primitive of points or lines was", "primitives of points and lines were"]
        } else {
            ["primitive of lines was", "primitives of lines were"]
        };
        notes.push(format!("{} ignored", counted(merged.ignored_primitives, primitives)));
    }
    let mut warnings = Vec::new();
    if model.has_copies() {
        let problem = "of meshes that EXT_mesh_gpu_instancing repeats, one copy is read";
        let text = format!("{problem}: export the scene again without that extension");
        warnings.push((WarningCode::LeftOut, text));
    }
    if merged.ignored_targets > 0 {
        let lost = counted(merged.ignored_targets, ["morph target is", "morph targets are"]);
        let text = format!(
            "{lost} not kept: export the shapes as meshes, and carry the result over to them by `Follower`"
        );
        warnings.push((WarningCode::LeftOut, text));
    }
    if merged.skins.is_none() {
        let count = animation_count(json);
        if count > 0 {
            let animations = counted(count, ["animation was", "animations were"]);
            notes.push(format!("{animations} left out, because no mesh of the scene has a skin"));
        }
    }
    let skin = merged.skins.and_then(|skins| skins.finish(size, &mut notes));
    let attributes = Attributes { skin, ..merged.attributes.into_attributes(model, &mut notes) };
    Ok(Loaded { mesh, attributes, notes, warnings, ..Loaded::default() })
}

/// Calls `visit` for each node of the default scene with its index, its parent and its transform to the
/// scene; parents come before their children.
pub(super) fn visit_nodes(
    model: &Model,
    mut visit: impl FnMut(usize, &Node, Option<usize>, DMat4) -> Result<()>,
) -> Result<()> {
    let mut seen = vec![false; model.nodes.len()];
    let mut pending: Vec<(usize, Option<usize>, DMat4)> =
        roots(model)?.into_iter().rev().map(|root| (root, None, DMat4::IDENTITY)).collect();
    while let Some((index, parent, parent_transform)) = pending.pop() {
        let place = || format!("node {index}");
        let (Some(node), Some(seen)) = (model.nodes.get(index), seen.get_mut(index)) else {
            return Err(scene_error(place(), "there is no such node"));
        };
        // A node may have one parent only: otherwise a few nodes could stand for billions, or form a cycle.
        if std::mem::replace(seen, true) {
            return Err(scene_error(place(), "the node occurs more than once in the scene"));
        }
        let transform = parent_transform * local_transform(node);
        visit(index, node, parent, transform)?;
        pending.extend(node.children.iter().rev().map(|child| (*child, Some(index), transform)));
    }
    Ok(())
}

/// The root nodes of the default scene; in a file without scenes, the nodes without a parent.
fn roots(model: &Model) -> Result<Vec<usize>> {
    if let Some(scene) = model.scenes.get(model.scene.unwrap_or(0)) {
        return Ok(scene.nodes.clone());
    }
    if let Some(missing) = model.scene {
        return Err(scene_error(format!("scene {missing}"), "there is no such scene"));
    }
    let mut root = vec![true; model.nodes.len()];
    for child in model.nodes.iter().flat_map(|node| &node.children) {
        if let Some(root) = root.get_mut(*child) {
            *root = false;
        }
    }
    Ok((0..root.len()).filter(|node| root.get(*node) == Some(&true)).collect())
}

fn local_transform(node: &Node) -> DMat4 {
    if let Some(matrix) = &node.matrix {
        return DMat4::from_cols_array(matrix);
    }
    let [x, y, z, w] = node.rotation.as_deref().copied().unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let rotation = DVec4::new(x, y, z, w).try_normalize().map_or(DQuat::IDENTITY, DQuat::from_vec4);
    DMat4::from_scale_rotation_translation(
        DVec3::from_array(node.scale.as_deref().copied().unwrap_or([1.0; 3])),
        rotation,
        DVec3::from_array(node.translation.as_deref().copied().unwrap_or([0.0; 3])),
    )
}

/// The triangles merged so far.
struct SceneMerger<'a> {
    model: &'a Model,
    buffers: &'a Buffers<'a>,
    mesh: TriMesh,
    attributes: AttributeReader,
    /// `None` in a scene without skins, and for points.
    skins: Option<SkinReader<'a>>,
    /// Whether points are merged, and not triangles.
    of_points: bool,
    has_points: bool,
    /// Primitives looked at.
    primitives: u64,
    ignored_primitives: u64,
    ignored_targets: usize,
}

impl<'a> SceneMerger<'a> {
    /// The triangles of the default scene with skins from this JSON, or without JSON its points.
    fn merge(model: &'a Model, buffers: &'a Buffers<'a>, json: Option<&[u8]>) -> Result<Self> {
        let skins = json.map(|json| SkinReader::new(model, buffers, json)).transpose()?.flatten();
        let mut merged = Self {
            model,
            buffers,
            mesh: TriMesh::default(),
            attributes: AttributeReader::default(),
            skins,
            of_points: json.is_none(),
            has_points: false,
            primitives: 0,
            ignored_primitives: 0,
            ignored_targets: 0,
        };
        visit_nodes(model, |index, node, _, transform| merged.add_node(node, index, transform))?;
        Ok(merged)
    }

    fn add_node(&mut self, node: &Node, index: usize, transform: DMat4) -> Result<()> {
        let Some(number) = node.mesh else { return Ok(()) };
        let Some(mesh) = self.model.meshes.get(number) else {
            return Err(scene_error(format!("node {index}"), format!("there is no mesh {number}")));
        };
        let targets = mesh.primitives.iter().map(|primitive| primitive.targets.len());
        self.ignored_targets += targets.max().unwrap_or(0);
        let transform = match &mut self.skins {
            Some(skins) => skins.start_mesh(index, node, transform),
            None => transform,
        };
        // The first vertex and the number of vertices by accessors, which primitives may share.
        let mut added = HashMap::new();
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let place = format!("mesh {number}, primitive {p}");
            self.primitives += 1;
            // Each takes a few bytes of the file, even if it has no triangles, unless nodes share meshes.
            if self.primitives > MOST_PRIMITIVES.max(self.buffers.read_bytes()) {
                return Err(repeat_error(&place));
            }
            let mode = primitive.mode.unwrap_or(TRIANGLES);
            self.has_points |= mode == POINTS;
            let is_wanted = if self.of_points { mode == POINTS } else { (TRIANGLES..=FAN).contains(&mode) };
            if !is_wanted {
                self.ignored_primitives += 1;
                continue;
            }
            let Some(position) = primitive.attributes.position else {
                let what = if self.of_points { "points" } else { "triangles" };
                return Err(scene_error(place, format!("the {what} have no positions")));
            };
            let accessors = primitive.attributes.of_vertices();
            let (first, count) = match added.get(&accessors) {
                Some(range) => *range,
                None => {
                    let (first, count) = self.add_vertices(position, transform, &place)?;
                    let source = (self.model, self.buffers);
                    self.attributes.add_vertices(source, primitive, (count, transform), &place)?;
                    if let Some(skins) = &mut self.skins {
                        skins.read_vertices(primitive, count, &place);
                    }
                    (first, count)
                }
            };
            added.insert(accessors, (first, count));
            if self.of_points {
                continue;
            }
            // Mirroring would turn the mesh inside out.
            let mirrored = transform.determinant() < 0.0;
            self.add_primitive(primitive, (first, count), mirrored, &place)?;
        }
        Ok(())
    }

    /// Adds the vertices of an accessor; returns the index of the first and their number.
    fn add_vertices(&mut self, accessor: usize, transform: DMat4, place: &str) -> Result<(u32, usize)> {
        let elements = self.buffers.elements(accessor, "VEC3")?;
        let first = self.mesh.vertices.len();
        check_counts((first + elements.count).max(1) as u64, 1)?;
        let influences = if self.skins.is_some() { size_of::<Influences>() } else { 0 };
        self.check_size(elements.count.saturating_mul(VERTEX_BYTES + influences), place)?;
        let transformed = elements.positions().map(|position| transform.transform_point3(position));
        self.mesh.vertices.extend(transformed);
        // In range, as checked above.
        Ok((first as u32, elements.count))
    }

    /// Refuses to add this many bytes to the mesh if that makes it very much larger than the file.
    fn check_size(&self, added_bytes: usize, place: &str) -> Result<()> {
        let bytes = self.size().saturating_add(added_bytes);
        if outgrows(bytes as u64, self.buffers.read_bytes()) { Err(repeat_error(place)) } else { Ok(()) }
    }

    /// Bytes of the mesh with its attributes.
    fn size(&self) -> usize {
        let mesh_bytes = 24 * self.mesh.vertices.len() + 12 * self.mesh.triangles.len();
        mesh_bytes + self.attributes.bytes() + self.skins.as_ref().map_or(0, SkinReader::bytes)
    }

    fn add_primitive(
        &mut self,
        primitive: &Primitive,
        (first, count): (u32, usize),
        mirrored: bool,
        place: &str,
    ) -> Result<()> {
        let corners = match primitive.indices {
            // The number of vertices fits u32, as checked above.
            None => (0..count as u32).collect(),
            Some(accessor) => self.indices(accessor, place)?,
        };
        if let Some(bad) = corners.iter().find(|corner| **corner as usize >= count) {
            let problem =
                format!("there is no vertex {bad}, indices go from 0 to {}", count.saturating_sub(1));
            return Err(scene_error(place.to_owned(), problem));
        }
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        if mode == TRIANGLES && corners.len() % 3 != 0 {
            let count = counted(corners.len(), ["corner is", "corners are"]);
            let problem = format!("{count} not a multiple of 3");
            return Err(scene_error(place.to_owned(), problem));
        }
        let triangles = if mode == TRIANGLES { corners.len() / 3 } else { corners.len() };
        self.check_size(triangles.saturating_mul(TRIANGLE_BYTES), place)?;
        let oriented = |[a, b, c]: [u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
        let triangles: Vec<[u32; 3]> = split_corners(&corners, mode).map(oriented).collect();
        self.attributes.add_triangles((self.model, self.buffers), primitive, (count, &triangles), place)?;
        self.mesh.triangles.extend(triangles.into_iter().map(|triangle| triangle.map(|v| first + v)));
        Ok(())
    }

    fn indices(&self, accessor: usize, place: &str) -> Result<Vec<u32>> {
        let elements = self.buffers.elements(accessor, "SCALAR")?;
        // The indices themselves fit the file, but many primitives may share them.
        self.check_size(4 * elements.count, place)?;
        let Some(indices) = elements.indices() else {
            return Err(scene_error(format!("accessor {accessor}"), "its numbers are not unsigned integers"));
        };
        Ok(indices.collect())
    }
}

/// The triangles of a list, strip or fan, without the degenerate ones that join parts of a strip.
fn split_corners(corners: &[u32], mode: u32) -> Box<dyn Iterator<Item = [u32; 3]> + '_> {
    match mode {
        STRIP => Box::new(corners.windows(3).enumerate().filter_map(|(i, three)| match *three {
            [a, b, c] if a == b || b == c || c == a => None,
            // Every second triangle of a strip has the opposite orientation.
            [a, b, c] => Some(if i % 2 == 1 { [a, c, b] } else { [a, b, c] }),
            _ => None,
        })),
        FAN => {
            let (hub, others) =
                corners.split_first().map_or((0, [].as_slice()), |(hub, others)| (*hub, others));
            Box::new(others.windows(2).filter_map(move |pair| match *pair {
                [a, b] => Some([a, b, hub]),
                _ => None,
            }))
        }
        _ => Box::new(corners.as_chunks::<3>().0.iter().copied()),
    }
}
