//! The triangles of the default scene, in its coordinates.

use std::collections::HashMap;

use glam::{DMat4, DQuat, DVec3, DVec4};

use super::accessors::Buffers;
use super::attributes::Beside;
use super::model::{Model, Node, Primitive};
use crate::io::{Loaded, check_counts, unfolds_too_far};
use crate::{Error, Result, TriMesh};

const TRIANGLES: u32 = 4;
const STRIP: u32 = 5;
const FAN: u32 = 6;

fn refused(place: String, problem: impl Into<String>) -> Error {
    Error::input(Some(place), problem, "write the mesh again")
}

/// Merges all triangles. `file_bytes` limits how often meshes may be repeated.
pub(crate) fn triangles<'a>(model: &'a Model, buffers: &'a Buffers<'a>, file_bytes: u64) -> Result<Loaded> {
    let mut merged = Merged {
        model,
        buffers,
        file_bytes,
        mesh: TriMesh::default(),
        beside: Beside::default(),
        passed_over: 0,
        skins: 0,
    };
    let mut seen = vec![false; model.nodes.len()];
    let mut waiting: Vec<(usize, DMat4)> =
        roots(model)?.into_iter().rev().map(|root| (root, DMat4::IDENTITY)).collect();
    while let Some((index, above)) = waiting.pop() {
        let place = || format!("node {index}");
        let (Some(node), Some(seen)) = (model.nodes.get(index), seen.get_mut(index)) else {
            return Err(refused(place(), "there is no such node"));
        };
        // A node has one parent; else a few could stand for billions, or go round for ever.
        if std::mem::replace(seen, true) {
            return Err(refused(place(), "the node has more than one place in the scene"));
        }
        let transform = above * local(node);
        merged.node(node, index, transform)?;
        waiting.extend(node.children.iter().rev().map(|child| (*child, transform)));
    }
    let mesh = merged.mesh;
    check_counts(mesh.vertices.len() as u64, mesh.triangles.len() as u64)?;
    let mut notes = Vec::new();
    if merged.passed_over > 0 {
        notes.push(format!("{} primitives of points and lines were ignored", merged.passed_over));
    }
    if merged.skins > 0 {
        notes.push(format!("{} skins were ignored; their meshes are as without pose", merged.skins));
    }
    let attributes = merged.beside.attributes(model, &mut notes);
    Ok(Loaded { mesh, attributes, notes })
}

/// The roots of the default scene; without any scene, the nodes that are nobody's children.
fn roots(model: &Model) -> Result<Vec<usize>> {
    if let Some(scene) = model.scenes.get(model.scene.unwrap_or(0)) {
        return Ok(scene.nodes.clone());
    }
    if let Some(missing) = model.scene {
        return Err(refused(format!("scene {missing}"), "there is no such scene"));
    }
    let mut root = vec![true; model.nodes.len()];
    for child in model.nodes.iter().flat_map(|node| &node.children) {
        if let Some(root) = root.get_mut(*child) {
            *root = false;
        }
    }
    Ok((0..root.len()).filter(|node| root.get(*node) == Some(&true)).collect())
}

fn local(node: &Node) -> DMat4 {
    if let Some(matrix) = &node.matrix {
        return DMat4::from_cols_array(matrix);
    }
    let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let turned = DVec4::new(x, y, z, w).try_normalize().map_or(DQuat::IDENTITY, DQuat::from_vec4);
    DMat4::from_scale_rotation_translation(
        DVec3::from_array(node.scale.unwrap_or([1.0; 3])),
        turned,
        DVec3::from_array(node.translation.unwrap_or([0.0; 3])),
    )
}

/// The scene so far.
struct Merged<'a> {
    model: &'a Model,
    buffers: &'a Buffers<'a>,
    file_bytes: u64,
    mesh: TriMesh,
    beside: Beside,
    passed_over: u64,
    skins: u64,
}

impl Merged<'_> {
    fn node(&mut self, node: &Node, index: usize, transform: DMat4) -> Result<()> {
        let Some(number) = node.mesh else { return Ok(()) };
        let Some(mesh) = self.model.meshes.get(number) else {
            return Err(refused(format!("node {index}"), format!("there is no mesh {number}")));
        };
        self.skins += u64::from(node.skin.is_some());
        // Where the vertices of an accessor begin, and how many there are: primitives may share them with all they have.
        let mut known = HashMap::new();
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let place = format!("mesh {number}, primitive {p}");
            if !(TRIANGLES..=FAN).contains(&primitive.mode.unwrap_or(TRIANGLES)) {
                self.passed_over += 1;
                continue;
            }
            let Some(position) = primitive.attributes.position else {
                return Err(refused(place, "the triangles have no positions"));
            };
            let shared = (position, primitive.attributes.colour, primitive.attributes.normal);
            let (first, count) = match known.get(&shared) {
                Some(range) => *range,
                None => {
                    let (first, count) = self.vertices(position, transform, &place)?;
                    let from = (self.model, self.buffers);
                    self.beside.vertices(from, primitive, (count, transform), &place)?;
                    (first, count)
                }
            };
            known.insert(shared, (first, count));
            // A mirrored mesh shows its inside.
            let mirrored = transform.determinant() < 0.0;
            self.primitive(primitive, (first, count), mirrored, &place)?;
        }
        Ok(())
    }

    /// Adds the vertices of an accessor; gives the first one's index and how many there are.
    fn vertices(&mut self, accessor: usize, transform: DMat4, place: &str) -> Result<(u32, usize)> {
        let elements = self.buffers.elements(accessor, "VEC3")?;
        let first = self.mesh.vertices.len();
        check_counts((first + elements.count).max(1) as u64, 1)?;
        self.check_size(24 * elements.count, place)?;
        let moved = elements.positions().map(|position| transform.transform_point3(position));
        self.mesh.vertices.extend(moved);
        let added = self.mesh.vertices.iter().skip(first);
        if let Some(bad) = added.into_iter().position(|vertex| !vertex.is_finite()) {
            let place = Some(format!("{place}, vertex {bad}"));
            return Err(Error::input(place, "a coordinate is not finite", "remove or mend the vertex"));
        }
        // In range, as was checked.
        Ok((first as u32, elements.count))
    }

    /// Refuses to add so many bytes to the mesh if it would become very much larger than the file.
    fn check_size(&self, more: usize, place: &str) -> Result<()> {
        let now = 24 * self.mesh.vertices.len() + 12 * self.mesh.triangles.len();
        let read = self.file_bytes.saturating_add(self.buffers.fetched_bytes());
        if unfolds_too_far(now.saturating_add(more) as u64, read) {
            let problem = "the scene repeats its meshes too often";
            return Err(Error::input(Some(place.to_owned()), problem, "write fewer of them into the file"));
        }
        Ok(())
    }

    fn primitive(
        &mut self,
        primitive: &Primitive,
        (first, count): (u32, usize),
        mirrored: bool,
        place: &str,
    ) -> Result<()> {
        let corners = match primitive.indices {
            // As many as there are vertices, which were counted.
            None => (0..count as u32).collect(),
            Some(accessor) => self.indices(accessor, place)?,
        };
        if let Some(bad) = corners.iter().find(|corner| **corner as usize >= count) {
            let problem =
                format!("there is no vertex {bad}, they count from 0 to {}", count.saturating_sub(1));
            return Err(refused(place.to_owned(), problem));
        }
        let mode = primitive.mode.unwrap_or(TRIANGLES);
        if mode == TRIANGLES && corners.len() % 3 != 0 {
            let problem = format!("{} corners are no whole number of triangles", corners.len());
            return Err(refused(place.to_owned(), problem));
        }
        self.check_size(12 * corners.len(), place)?;
        let oriented = |[a, b, c]: [u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
        let own: Vec<[u32; 3]> = split(&corners, mode).map(oriented).collect();
        self.beside.triangles((self.model, self.buffers), primitive, (count, &own), place)?;
        self.mesh.triangles.extend(own.into_iter().map(|triangle| triangle.map(|v| first + v)));
        Ok(())
    }

    fn indices(&self, accessor: usize, place: &str) -> Result<Vec<u32>> {
        let elements = self.buffers.elements(accessor, "SCALAR")?;
        // They are all in the file, but many primitives may share them.
        self.check_size(12 * elements.count, place)?;
        let Some(indices) = elements.indices() else {
            return Err(refused(format!("accessor {accessor}"), "its numbers are no indices"));
        };
        Ok(indices.collect())
    }
}

/// Triangles of a list, strip or fan; strips without those that only turn the corner.
fn split(corners: &[u32], mode: u32) -> Box<dyn Iterator<Item = [u32; 3]> + '_> {
    match mode {
        STRIP => Box::new(corners.windows(3).enumerate().filter_map(|(i, three)| match *three {
            [a, b, c] if a == b || b == c || c == a => None,
            // Every second one runs the other way round.
            [a, b, c] => Some(if i % 2 == 1 { [a, c, b] } else { [a, b, c] }),
            _ => None,
        })),
        FAN => {
            let (hub, rim) = corners.split_first().map_or((0, [].as_slice()), |(hub, rim)| (*hub, rim));
            Box::new(rim.windows(2).filter_map(move |pair| match *pair {
                [a, b] => Some([a, b, hub]),
                _ => None,
            }))
        }
        _ => Box::new(corners.as_chunks::<3>().0.iter().copied()),
    }
}
