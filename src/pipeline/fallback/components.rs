//! The components of the input: how many vertices each gets, and which of them are too small for cells.

use super::allot::{COMPACT, Claim, MOST_FOR_SHAPE, OF_PLATES, SMALL, allot, too_few};
use super::remesh::{ComponentTarget, least_vertices, remesh_component};
use crate::measure::{relative_volume, triangle_bounds};
use crate::mesh::repair::connected_components;
use crate::mesh::sizing::SizeField;
use crate::mesh::submesh::{append, extract};
use crate::mesh::topology::topology;
use crate::pipeline::intersections::intersecting_in_units;
use crate::{Error, Result, TriMesh};
use rayon::prelude::*;
use std::collections::HashSet;

/// Vertices that the largest component gets, however many others there are, if it has as many in the input.
const ENOUGH: usize = 32;
/// With fewer vertices for each large component, it is made sure that its topology does not need more.
const FEW_FOR_LARGE: usize = 64;
/// Where the topology needs more vertices, and more than there are, it takes long to find how many.
const MANY_NEEDED: usize = 1000;
/// Maximum number of times that the vertices of small components that run into others are doubled.
const DOUBLINGS: u32 = 4;
/// If components of more than this share of the area have another topology than the surface, nothing is
/// improved, and the others are remeshed with them.
const NEARLY_ALL: f64 = 0.9;
/// Cells of a compact component need this many times the vertices that show its shape.
const ROUND: f64 = 1.5;
/// No component has cells with fewer vertices: a ball, whose shape needs the fewest, has them from 16.3 on.
const FEWEST_FOR_CELLS: f64 = 16.0;
/// Vertices of the smallest other component on the coarsest level.
const ON_COARSEST: f64 = 12.0;

/// The components of a mesh, in the unit-diagonal frame.
pub(crate) struct Components {
    /// The component of each triangle.
    of_triangle: Vec<u32>,
    areas: Vec<f64>,
    /// The triangles of each component.
    triangles: Vec<Vec<u32>>,
}

/// Components that are too small for cells, and the others.
pub(crate) struct Division {
    /// Indices of the triangles that are not in small components.
    pub large: Vec<u32>,
    /// The small components, remeshed.
    pub small: Vec<TriMesh>,
    /// Vertices left for the large ones.
    pub vertices_left: usize,
    /// Least number of vertices of the coarsest level.
    pub coarsest: usize,
}

impl Components {
    pub fn new(mesh: &TriMesh) -> Self {
        let (of_triangle, areas) = connected_components(mesh);
        let mut triangles = vec![Vec::new(); areas.len()];
        (0..).zip(&of_triangle).for_each(|(t, part)| triangles[*part as usize].push(t));
        Self { of_triangle, areas, triangles }
    }

    /// Number of components.
    pub fn count(&self) -> usize {
        self.areas.len()
    }

    /// Total area.
    pub fn area(&self) -> f64 {
        self.areas.iter().sum()
    }

    /// A component of the mesh by itself.
    fn submesh(&self, mesh: &TriMesh, part: usize) -> TriMesh {
        extract(mesh, &self.triangles[part])
    }

    /// The number of vertices of each component.
    fn vertex_counts(&self, mesh: &TriMesh) -> Vec<usize> {
        // The last component that each vertex was counted for.
        let mut counted = vec![usize::MAX; mesh.vertices.len()];
        let count = |(part, triangles): (usize, &Vec<u32>)| {
            let corners = triangles.iter().flat_map(|t| mesh.triangles[*t as usize]);
            corners.filter(|v| std::mem::replace(&mut counted[*v as usize], part) != part).count()
        };
        self.triangles.iter().enumerate().map(count).collect()
    }

    fn submeshes(&self, mesh: &TriMesh) -> Vec<TriMesh> {
        (0..self.count()).map(|part| self.submesh(mesh, part)).collect()
    }

    /// Remeshes the small components by themselves and counts the vertices left for the others. A small one
    /// that runs through itself or others, though it does not in the input, gets more vertices. None is small
    /// that gets enough vertices by the lengths that are `refined` at the vertices of the mesh.
    ///
    /// # Errors [`crate::Error::Usage`] with the least number of vertices if there are too few,
    /// [`crate::Error::Cancelled`].
    pub fn divide(&self, mesh: &TriMesh, refined: &[f64], target: &ComponentTarget) -> Result<Division> {
        let needed = || vertices_needed(&self.submeshes(mesh));
        at_any_cost(target, needed, |target| self.division(mesh, refined, target))
    }

    fn division(&self, mesh: &TriMesh, refined: &[f64], target: &ComponentTarget) -> Result<Division> {
        let whole = self.area();
        let share = |part: usize| target.vertices as f64 * self.areas[part] / whole;
        let largest = (0..self.count()).max_by(|a, b| self.areas[*a].total_cmp(&self.areas[*b])).unwrap_or(0);
        let is_mostly_small = self.is_mostly_small(target.vertices);
        let (small, large): (Vec<usize>, Vec<usize>) = (0..self.count()).partition(|part| {
            let is_small = || self.refined_vertices(mesh, *part, refined) < SMALL;
            *part != largest
                && share(*part) < SMALL
                && is_small()
                && !(is_mostly_small
                    && share(*part) >= FEWEST_FOR_CELLS
                    && is_enough_for_cells(share(*part), &self.submesh(mesh, *part)))
        });
        let of_small: Vec<TriMesh> = small.iter().map(|part| self.submesh(mesh, *part)).collect();
        let parts: Vec<Part> =
            small.iter().zip(&of_small).map(|(part, of)| Part::new(of, self.areas[*part])).collect();
        let claim =
            |(area, vertices): (&f64, usize)| Claim { area: *area, vertices, shape: COMPACT, least: 0 };
        let mut claims: Vec<Claim> = self.areas.iter().zip(self.vertex_counts(mesh)).map(claim).collect();
        small.iter().zip(&of_small).for_each(|(part, of)| claims[*part].shape = shape_vertices(of));
        claims[largest].least = claims[largest].vertices.min(ENOUGH);
        let of_large = |counts: &[usize]| large.iter().map(|part| counts[*part]).sum::<usize>();
        let counts_of = |counts: &[usize]| small.iter().map(|part| counts[*part]).collect::<Vec<usize>>();
        let left = |meshes: &[TriMesh]| {
            target.vertices.saturating_sub(meshes.iter().map(|part| part.vertices.len()).sum())
        };
        let counts = match allot(&claims, target.vertices) {
            Ok(counts) => counts,
            Err(_) => self.above_least(mesh, &claims, target)?,
        };
        let mut remeshed = remesh_each(&parts, counts_of(&counts), Remeshed::default(), target)?;
        // Their topology may need more than that, or that of the large ones more than is left.
        let left_over = left(&remeshed.meshes);
        let is_little = left_over < FEW_FOR_LARGE * large.len();
        let least_of_large = if is_little { self.least(mesh, &large, target)? } else { 0 };
        if 2 * left_over < of_large(&counts) || left_over < least_of_large {
            let counts = self.above_least(mesh, &claims, target)?;
            remeshed = remesh_each(&parts, counts_of(&counts), remeshed, target)?;
        }
        let mut meshes = remeshed.meshes;
        let least_left = (left(&meshes) / 2).max(least_of_large);
        for _ in 0..DOUBLINGS {
            let crossing = self.crossing(mesh, &small, &meshes, target)?;
            if crossing.is_empty() {
                break;
            }
            let mut apart = meshes.clone();
            let doubled = |k: &usize| {
                let target = target.with_vertices(2 * meshes[*k].vertices.len());
                remesh_component(&of_small[*k], &[], &target)
            };
            let new: Vec<TriMesh> = crossing.par_iter().map(doubled).collect::<Result<_>>()?;
            crossing.into_iter().zip(new).for_each(|(k, mesh)| apart[k] = mesh);
            if left(&apart) < least_left.max(3) {
                break;
            }
            meshes = apart;
        }
        let area: f64 = large.iter().map(|part| self.areas[*part]).sum();
        let smallest = large.iter().map(|part| self.areas[*part]).fold(area, f64::min);
        let coarsest = if large.len() > 1 { (ON_COARSEST * area / smallest) as usize } else { 0 };
        let is_large: HashSet<usize> = large.into_iter().collect();
        let triangles =
            (0..).zip(&self.of_triangle).filter(|(_, part)| is_large.contains(&(**part as usize)));
        Ok(Division {
            large: triangles.map(|(t, _)| t).collect(),
            vertices_left: left(&meshes),
            small: meshes,
            coarsest,
        })
    }

    /// About how many vertices a component gets by the lengths at the vertices of the mesh, where they are
    /// finite.
    fn refined_vertices(&self, mesh: &TriMesh, part: usize, lengths: &[f64]) -> f64 {
        if lengths.is_empty() {
            return 0.0;
        }
        let of = |t: &u32| {
            let length = mesh.triangles[*t as usize].iter().map(|v| lengths[*v as usize]).sum::<f64>() / 3.0;
            mesh.triangle_area(*t as usize) / length.powi(2)
        };
        self.triangles[part].iter().map(of).sum::<f64>() * 2.0 / 3f64.sqrt()
    }

    /// Whether components with few vertices have half of the area or more. Beside larger ones they are better
    /// made by local operations, since coarse levels of cells have some vertices for each.
    fn is_mostly_small(&self, vertices: usize) -> bool {
        let whole = self.area();
        let is_small = |area: &&f64| vertices as f64 * **area < SMALL * whole;
        self.areas.iter().filter(is_small).sum::<f64>() >= 0.5 * whole
    }

    /// The least number of vertices that these components need: none is looked for that has enough of them by
    /// area.
    fn least(&self, mesh: &TriMesh, parts: &[usize], target: &ComponentTarget) -> Result<usize> {
        let whole = self.area();
        let least = |part: &usize| {
            let surface = self.submesh(mesh, *part);
            let share = target.vertices as f64 * self.areas[*part] / whole;
            if is_enough_for_cells(share, &surface) {
                return Ok(COMPACT);
            }
            least_vertices(&surface, target)
        };
        parts.par_iter().map(least).sum()
    }

    /// Vertices for each component: the least number that it needs, and a share of the others.
    fn above_least(&self, mesh: &TriMesh, claims: &[Claim], target: &ComponentTarget) -> Result<Vec<usize>> {
        let with_least = |(part, claim): (usize, &Claim)| -> Result<Claim> {
            Ok(Claim { least: least_vertices(&self.submesh(mesh, part), target)?, ..*claim })
        };
        let claims: Vec<Claim> = claims.par_iter().enumerate().map(with_least).collect::<Result<_>>()?;
        allot(&claims, target.vertices)
    }

    /// Which of the remeshed small components run through themselves or others, other than in the input.
    fn crossing(
        &self,
        mesh: &TriMesh,
        small: &[usize],
        meshes: &[TriMesh],
        target: &ComponentTarget,
    ) -> Result<Vec<usize>> {
        let is_small: HashSet<usize> = small.iter().copied().collect();
        let large = (0..).zip(&self.of_triangle).filter(|(_, part)| !is_small.contains(&(**part as usize)));
        let mut all = extract(mesh, &large.map(|(t, _)| t).collect::<Vec<u32>>());
        let mut ends = vec![all.triangles.len()];
        for part in meshes {
            append(&mut all, part);
            ends.push(all.triangles.len());
        }
        let crossing = intersecting_in_units(&all, target.frame, target.progress)?;
        let of = |t: u32| ends.partition_point(|end| *end <= t as usize);
        let mut list: Vec<usize> = crossing.into_iter().filter_map(|t| of(t).checked_sub(1)).collect();
        list.dedup();
        if list.is_empty() {
            return Ok(list);
        }
        let in_input = intersecting_in_units(mesh, target.frame, target.progress)?;
        let already: HashSet<u32> = in_input.iter().map(|t| self.of_triangle[*t as usize]).collect();
        list.retain(|k| !already.contains(&(small[*k] as u32)));
        Ok(list)
    }
}

/// What [`Components::repair`] has to know of the surface and of the faulty result on it.
pub(crate) struct RepairInput<'a> {
    pub surface: &'a TriMesh,
    /// The triangle of the surface under each vertex of the result.
    pub under: &'a [u32],
    /// Faces of the result whose components are replaced in any case.
    pub faulty_faces: &'a [u32],
    /// Vertices of the surface whose components are replaced in any case.
    pub missing: &'a [u32],
}

/// A result by the components of the surface.
struct Comparison {
    /// Whether the result has the component's topology.
    is_right: Vec<bool>,
    triangles: Vec<Vec<u32>>,
    vertices: Vec<usize>,
}

impl Components {
    /// Replaces the components of `result` that do not have the topology of the surface, or other faults, by
    /// new ones, with as many vertices in all; returns the number of components replaced. Where nearly all of
    /// the area has another topology, all are, if there are enough vertices for that.
    ///
    /// # Errors [`crate::Error::Usage`] with the least number of vertices if there are too few,
    /// [`crate::Error::Cancelled`].
    pub fn repair(
        &self,
        result: &mut TriMesh,
        input: &RepairInput,
        target: &ComponentTarget,
    ) -> Result<usize> {
        let RepairInput { surface, under, faulty_faces, missing } = *input;
        if self.count() == 1 && faulty_faces.is_empty() && missing.is_empty() {
            let got = topology(result);
            if got.vertices == result.vertices.len() && got.matches(&topology(surface)) {
                return Ok(0);
            }
        }
        let part_of = |v: u32| self.of_triangle[under[v as usize] as usize] as usize;
        let submeshes = self.submeshes(surface);
        let found = self.compare(&submeshes, result, &part_of);
        let hardly_improved = self.are_nearly_all(&found.is_right);
        let mut is_right = found.is_right.clone();
        let faulty = faulty_faces.iter().flat_map(|t| result.triangles[*t as usize]);
        faulty.for_each(|v| is_right[part_of(v)] = false);
        if !missing.is_empty() {
            let missing: HashSet<u32> = missing.iter().copied().collect();
            for (triangle, part) in surface.triangles.iter().zip(&self.of_triangle) {
                is_right[*part as usize] &= !triangle.iter().any(|v| missing.contains(v));
            }
        }
        if hardly_improved {
            match self.replace(result, &vec![false; self.count()], &found, (&submeshes, target)) {
                Err(Error::Usage { .. }) => {}
                replaced => return replaced,
            }
        }
        self.replace(result, &is_right, &found, (&submeshes, target))
    }

    /// Replaces the components that are not right, as [`Components::repair`] does.
    fn replace(
        &self,
        result: &mut TriMesh,
        is_right: &[bool],
        found: &Comparison,
        (submeshes, target): (&[TriMesh], &ComponentTarget),
    ) -> Result<usize> {
        let Comparison { triangles, vertices, .. } = found;
        let (right, wrong): (Vec<usize>, Vec<usize>) = (0..self.count()).partition(|part| is_right[*part]);
        if wrong.is_empty() {
            return Ok(0);
        }
        let kept: usize = right.iter().map(|part| vertices[*part]).sum();
        let parts: Vec<Part> =
            wrong.iter().map(|part| self.sized_part(&submeshes[*part], *part, target.sizes)).collect();
        let remeshed = remesh_all(&parts, &target.with_vertices(result.vertices.len() - kept))?;
        let keep: Vec<u32> = right.iter().flat_map(|part| triangles[*part].clone()).collect();
        *result = extract(result, &keep);
        remeshed.iter().for_each(|part| append(result, part));
        Ok(wrong.len())
    }

    /// Whether the triangles of a result over these triangles of the surface have another topology nearly
    /// everywhere, so that [`Components::repair`] replaces all of them.
    pub fn are_replaced(&self, surface: &TriMesh, result: &TriMesh, under: &[u32]) -> bool {
        let part_of = |v: u32| self.of_triangle[under[v as usize] as usize] as usize;
        self.are_nearly_all(&self.compare(&self.submeshes(surface), result, &part_of).is_right)
    }

    /// Whether those that are not right have nearly all of the area.
    fn are_nearly_all(&self, is_right: &[bool]) -> bool {
        let wrong: f64 =
            self.areas.iter().zip(is_right).filter(|(_, is_right)| !**is_right).map(|(area, _)| area).sum();
        wrong > NEARLY_ALL * self.area()
    }

    /// Compares the components of a result with those of the surface.
    fn compare(&self, submeshes: &[TriMesh], result: &TriMesh, part_of: &dyn Fn(u32) -> usize) -> Comparison {
        let mut triangles = vec![Vec::new(); self.count()];
        let mut is_right = vec![true; self.count()];
        for (t, triangle) in (0..).zip(&result.triangles) {
            let [a, b, c] = triangle.map(part_of);
            triangles[a].push(t);
            if a != b || b != c {
                [a, b, c].iter().for_each(|part| is_right[*part] = false);
            }
        }
        let mut vertices = vec![0; self.count()];
        (0..result.vertices.len() as u32).for_each(|v| vertices[part_of(v)] += 1);
        for (part, right) in is_right.iter_mut().enumerate().filter(|(_, right)| **right) {
            let got = topology(&extract(result, &triangles[part]));
            *right = got.vertices == vertices[part] && got.matches(&topology(&submeshes[part]));
        }
        Comparison { is_right, triangles, vertices }
    }

    /// A component with its target lengths.
    fn sized_part<'s>(&self, submesh: &'s TriMesh, part: usize, sizes: Option<&SizeField>) -> Part<'s> {
        let Some(sizes) = sizes.filter(|sizes| !sizes.is_uniform()) else {
            return Part::new(submesh, self.areas[part]);
        };
        let mut lengths = vec![1.0; submesh.vertices.len()];
        let mut area = 0.0;
        for (k, t) in self.triangles[part].iter().enumerate() {
            let at_corners = sizes.at_corners(*t);
            submesh.triangles[k].iter().zip(at_corners).for_each(|(v, length)| lengths[*v as usize] = length);
            area += submesh.triangle_area(k) * sizes.density(*t as usize);
        }
        Part { lengths, ..Part::new(submesh, area) }
    }

    /// The whole surface remeshed.
    ///
    /// # Errors [`crate::Error::Usage`] with the least number of vertices if there are too few,
    /// [`crate::Error::Cancelled`].
    pub fn remesh(&self, surface: &TriMesh, target: &ComponentTarget) -> Result<TriMesh> {
        let submeshes = self.submeshes(surface);
        let parts: Vec<Part> = (submeshes.iter().enumerate())
            .map(|(part, submesh)| self.sized_part(submesh, part, target.sizes))
            .collect();
        let mut result = TriMesh::default();
        at_any_cost(target, || vertices_needed(&submeshes), |target| remesh_all(&parts, target))?
            .iter()
            .for_each(|part| append(&mut result, part));
        Ok(result)
    }
}

/// A component to be remeshed.
struct Part<'a> {
    surface: &'a TriMesh,
    /// By which the vertices are shared out: more than the area where edges are shorter.
    area: f64,
    /// The relative target length at each vertex; empty if they are all equal.
    lengths: Vec<f64>,
}

impl<'a> Part<'a> {
    fn new(surface: &'a TriMesh, area: f64) -> Self {
        Self { surface, area, lengths: Vec::new() }
    }
}

/// Remeshed components, with the numbers of vertices that were asked for.
#[derive(Default)]
struct Remeshed {
    counts: Vec<usize>,
    meshes: Vec<TriMesh>,
}

impl Remeshed {
    /// Whether each has its number.
    fn fit(&self) -> bool {
        self.meshes.iter().zip(&self.counts).all(|(mesh, count)| mesh.vertices.len() == *count)
    }
}

/// The components remeshed with these numbers of vertices, or more if their topology needs more; those whose
/// number has not changed are taken over.
fn remesh_each(
    parts: &[Part],
    counts: Vec<usize>,
    mut before: Remeshed,
    target: &ComponentTarget,
) -> Result<Remeshed> {
    before.meshes.resize(parts.len(), TriMesh::default());
    let make = |(k, known): (usize, TriMesh)| match before.counts.get(k) {
        Some(count) if *count == counts[k] => Ok(known),
        _ => remesh_component(parts[k].surface, &parts[k].lengths, &target.with_vertices(counts[k])),
    };
    let meshes = before.meshes.into_par_iter().enumerate().map(make).collect::<Result<_>>()?;
    Ok(Remeshed { counts, meshes })
}

/// Vertices that show the shape of a surface.
fn shape_vertices(surface: &TriMesh) -> usize {
    if topology(surface).boundary_edges > 0 {
        return COMPACT;
    }
    let needed = as_rods_need(surface);
    if needed > OF_PLATES as f64 { COMPACT } else { (needed as usize).clamp(COMPACT, MOST_FOR_SHAPE) }
}

/// Vertices that show the shape of a closed surface. One of volume V and area A is about as thick as a rod of
/// radius 2 V / A, and edges may be as long as the sides of a triangle inscribed in that.
fn as_rods_need(surface: &TriMesh) -> f64 {
    let (lo, hi) = triangle_bounds(surface);
    let volume = relative_volume(surface).abs() * (hi - lo).element_product();
    let area = surface.area();
    let side = 3f64.sqrt() * 2.0 * volume / area;
    2.0 * area / (3f64.sqrt() * side * side)
}

/// Whether cells of so many vertices are likely to have the topology of a surface: of a compact one without
/// handles, boundary or defects. Of others, this is not known.
fn is_enough_for_cells(vertices: f64, surface: &TriMesh) -> bool {
    let topology = topology(surface);
    topology.is_closed_manifold() && topology.genus == Some(0) && vertices >= ROUND * as_rods_need(surface)
}

/// What is made of components. If there are too few vertices for that, faces may intersect; not if many more
/// are `needed` for their topology, as in noise.
fn at_any_cost<T>(
    target: &ComponentTarget,
    needed: impl FnOnce() -> usize,
    make: impl Fn(&ComponentTarget) -> Result<T>,
) -> Result<T> {
    let made = make(target);
    if target.refuses || !matches!(made, Err(Error::Usage { .. })) {
        return made;
    }
    let needed = needed();
    if needed > MANY_NEEDED && target.vertices < needed {
        return made;
    }
    make(&ComponentTarget { may_intersect: true, ..*target })
}

/// Vertices without which components hardly have their topology.
fn vertices_needed(components: &[TriMesh]) -> usize {
    let of = |mesh: &TriMesh| {
        let topology = topology(mesh);
        // No closed surface is smaller than a tetrahedron.
        topology.vertices_needed().max(if topology.boundary_loops > 0 { 3 } else { 4 })
    };
    components.iter().map(of).sum()
}

/// The components remeshed, each with its share of the vertices, or with more if a small one needs them.
///
/// # Errors [`crate::Error::Usage`] with the least number of vertices if there are too few,
/// [`crate::Error::Cancelled`].
fn remesh_all(parts: &[Part], target: &ComponentTarget) -> Result<Vec<TriMesh>> {
    let claim = |part: &Part| Claim {
        area: part.area,
        vertices: part.surface.vertices.len(),
        shape: shape_vertices(part.surface),
        least: 0,
    };
    let mut claims: Vec<Claim> = parts.iter().map(claim).collect();
    let counts = allot(&claims, target.vertices)?;
    let remeshed = remesh_each(parts, counts, Remeshed::default(), target)?;
    if remeshed.fit() {
        return Ok(remeshed.meshes);
    }
    // One that has more than its number has the least already.
    let least = |(k, part): (usize, &Part)| match remeshed.meshes[k].vertices.len() {
        vertices if vertices > remeshed.counts[k] => Ok(vertices),
        _ => least_vertices(part.surface, target),
    };
    let least: Vec<usize> = parts.par_iter().enumerate().map(least).collect::<Result<_>>()?;
    claims.iter_mut().zip(least).for_each(|(claim, least)| claim.least = least);
    let counts = allot(&claims, target.vertices)?;
    let remeshed = remesh_each(parts, counts, remeshed, target)?;
    if remeshed.fit() {
        return Ok(remeshed.meshes);
    }
    // With sharp edges, the least number of vertices is not always reached.
    Err(too_few(target.vertices, parts.len(), 2 * target.vertices))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples::sample;

    #[test]
    fn cells_are_enough_for_compact_shapes_without_handles() {
        let mut open = sample("sphere").unwrap();
        open.triangles.pop();
        let box_of = |height: f64| {
            let mut mesh = sample("box").unwrap();
            mesh.vertices.iter_mut().for_each(|v| v.z *= height);
            mesh
        };
        for (mesh, vertices, expected) in [
            (sample("sphere").unwrap(), 17.0, true),
            (sample("sphere").unwrap(), 16.1, false),
            (open, 100.0, false),
            (sample("torus").unwrap(), 1000.0, false),
            (box_of(1.0), 40.0, true),
            (box_of(0.1), 40.0, false),
        ] {
            assert_eq!(is_enough_for_cells(vertices, &mesh), expected, "{vertices}");
        }
    }

    #[test]
    fn components_are_mostly_small_if_the_large_ones_have_less_than_half_of_the_area() {
        let ball = sample("sphere").unwrap();
        let balls = |scales: &[f64]| {
            let mut surface = TriMesh::default();
            for (k, scale) in scales.iter().enumerate() {
                let vertices = ball.vertices.iter().map(|p| *p * *scale + 9.0 * k as f64 * glam::DVec3::X);
                append(
                    &mut surface,
                    &TriMesh { vertices: vertices.collect(), triangles: ball.triangles.clone() },
                );
            }
            Components::new(&surface)
        };
        let few = SMALL as usize;
        assert!(balls(&[1.0; 4]).is_mostly_small(2 * few));
        assert!(!balls(&[1.0; 4]).is_mostly_small(5 * few));
        assert!(!balls(&[1.0, 0.1, 0.1]).is_mostly_small(10 * few));
    }

    #[test]
    fn all_are_replaced_where_nearly_all_of_the_area_is_wrong() {
        let large = sample("bumpy-sphere").unwrap();
        for (scale, expected) in [(0.2, true), (0.5, false), (1.0, false)] {
            let mut surface = large.clone();
            let vertices = large.vertices.iter().map(|p| *p * scale + 9.0 * glam::DVec3::X).collect();
            append(&mut surface, &TriMesh { vertices, triangles: large.triangles.clone() });
            let mut under = vec![0; surface.vertices.len()];
            for (t, triangle) in (0..).zip(&surface.triangles) {
                triangle.iter().for_each(|v| under[*v as usize] = t);
            }
            let components = Components::new(&surface);
            assert!(!components.are_replaced(&surface, &surface, &under));
            // A hole in the first component, which is the larger one.
            let torn = TriMesh { triangles: surface.triangles[1..].to_vec(), ..surface.clone() };
            assert_eq!(components.are_replaced(&surface, &torn, &under), expected, "{scale}");
        }
    }
}
