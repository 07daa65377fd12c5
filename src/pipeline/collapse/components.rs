//! The components of the input: how many vertices each gets, and which of them are too small for cells.

use super::simplify::{SimplifyTarget, simplified, simplified_and_polished};
use crate::mesh::repair::connected_components;
use crate::mesh::simplify::Site;
use crate::mesh::sizing::SizeField;
use crate::mesh::submesh::{append, extract};
use crate::mesh::topology::topology;
use crate::{Error, Result, TriMesh};
use std::collections::HashSet;

/// A component with a smaller share of the vertices than this is simplified, unless it is the largest.
const SMALL: f64 = 32.0;
/// Vertices that the largest component gets, however many others there are.
const ENOUGH: f64 = 32.0;
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
    /// The small components, simplified.
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

    fn submeshes(&self, mesh: &TriMesh) -> Vec<TriMesh> {
        (0..self.count()).map(|part| self.submesh(mesh, part)).collect()
    }

    /// Simplifies the small components and counts the vertices left for the others.
    ///
    /// # Errors
    /// [`Error::Usage`] with the least number of vertices if there are too few, [`Error::Cancelled`].
    pub fn divide(&self, mesh: &TriMesh, target: &SimplifyTarget) -> Result<Division> {
        let whole: f64 = self.areas.iter().sum();
        let share = |part: usize| target.vertices as f64 * self.areas[part] / whole;
        let largest = (0..self.count()).max_by(|a, b| self.areas[*a].total_cmp(&self.areas[*b])).unwrap_or(0);
        let is_small = |part: usize| part != largest && share(part) < SMALL;
        let simplify = |vertices: &dyn Fn(usize) -> usize| -> Result<Vec<TriMesh>> {
            let small = (0..self.count()).filter(|part| is_small(*part));
            small
                .map(|part| {
                    let target = target.with_vertices(vertices(part));
                    simplified_and_polished(&self.submesh(mesh, part), (&[], &[]), &target)
                })
                .collect()
        };
        let left = |small: &[TriMesh]| {
            target.vertices.saturating_sub(small.iter().map(|part| part.vertices.len()).sum())
        };
        let mut small = simplify(&|part| (share(part).round() as usize).max(3))?;
        let large_shares: f64 = (0..self.count()).filter(|part| !is_small(*part)).map(share).sum();
        // Small components may get more than their share, unless too little is left for the large ones.
        if !small.is_empty() && (left(&small) as f64) < (0.5 * large_shares).max(ENOUGH) {
            let submeshes = self.submeshes(mesh);
            let parts: Vec<_> = submeshes.iter().zip(self.areas.iter().copied()).map(Part::new).collect();
            let counts = vertices_above_least(&parts, target)?;
            small = simplify(&|part| counts[part])?;
        }
        let vertices_left = left(&small);
        let large: Vec<usize> = (0..self.count()).filter(|part| !is_small(*part)).collect();
        let area: f64 = large.iter().map(|part| self.areas[*part]).sum();
        let smallest = large.iter().map(|part| self.areas[*part]).fold(area, f64::min);
        let coarsest = if large.len() > 1 { (ON_COARSEST * area / smallest) as usize } else { 0 };
        let triangles = (0..).zip(&self.of_triangle).filter(|(_, part)| !is_small(**part as usize));
        Ok(Division { large: triangles.map(|(t, _)| t).collect(), small, vertices_left, coarsest })
    }
}

/// Positions of the vertices of a simplified component.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Spread {
    /// Where the faulty result had them.
    AsBefore,
    /// Anywhere.
    Evenly,
}

/// What [`Components::repair`] has to know of the surface and of the faulty result on it.
pub(crate) struct RepairInput<'a> {
    pub surface: &'a TriMesh,
    /// The result's vertices before the polish, on the surface.
    pub sites: &'a [Site],
    /// Faces of the result whose components are replaced in any case.
    pub faulty_faces: &'a [u32],
    /// Vertices of the surface whose components are replaced in any case.
    pub missing: &'a [u32],
    pub spread: Spread,
}

/// A result by the components of the surface.
struct Comparison {
    /// Whether the result has the component's topology.
    is_right: Vec<bool>,
    triangles: Vec<Vec<u32>>,
    vertices: Vec<usize>,
}

impl Components {
    /// Replaces the components of `result` that do not have the topology of the surface by simplified ones,
    /// with as many vertices in all; returns the number of components replaced.
    ///
    /// # Errors
    /// [`Error::Usage`] with the least number of vertices if there are too few, [`Error::Cancelled`].
    pub fn repair(
        &self,
        result: &mut TriMesh,
        input: &RepairInput,
        target: &SimplifyTarget,
    ) -> Result<usize> {
        let RepairInput { surface, sites, faulty_faces, missing, spread } = *input;
        if self.count() == 1 && faulty_faces.is_empty() && missing.is_empty() {
            let got = topology(result);
            if got.vertices == result.vertices.len() && got.matches(&topology(surface)) {
                return Ok(0);
            }
        }
        let part_of = |v: u32| self.of_triangle[sites[v as usize].triangle as usize] as usize;
        let submeshes = self.submeshes(surface);
        let Comparison { mut is_right, triangles, vertices } = self.compare(&submeshes, result, &part_of);
        let faulty = faulty_faces.iter().flat_map(|t| result.triangles[*t as usize]);
        faulty.for_each(|v| is_right[part_of(v)] = false);
        if !missing.is_empty() {
            let missing: HashSet<u32> = missing.iter().copied().collect();
            for (triangle, part) in surface.triangles.iter().zip(&self.of_triangle) {
                is_right[*part as usize] &= !triangle.iter().any(|v| missing.contains(v));
            }
        }
        let wrong: Vec<usize> = (0..self.count()).filter(|part| !is_right[*part]).collect();
        if wrong.is_empty() {
            return Ok(0);
        }
        let kept: usize = (0..self.count()).filter(|part| is_right[*part]).map(|part| vertices[part]).sum();
        // Indices of triangles in their component.
        let mut index_in_part = vec![0; self.of_triangle.len()];
        for part in &wrong {
            (0..).zip(&self.triangles[*part]).for_each(|(new, t)| index_in_part[*t as usize] = new);
        }
        let sites_of = |part: usize| {
            let own = (0..).zip(sites).filter(|(v, _)| part_of(*v) == part);
            own.map(|(_, s)| Site { triangle: index_in_part[s.triangle as usize], ..*s }).collect()
        };
        let part = |part: usize| Part {
            sites: if spread == Spread::AsBefore { sites_of(part) } else { Vec::new() },
            ..self.sized_part(&submeshes[part], part, target.sizes)
        };
        let parts: Vec<Part> = wrong.iter().map(|number| part(*number)).collect();
        let simplified = simplify_all(&parts, &target.with_vertices(result.vertices.len() - kept))?;
        let right = (0..self.count()).filter(|part| is_right[*part]);
        let keep: Vec<u32> = right.flat_map(|part| triangles[part].clone()).collect();
        *result = extract(result, &keep);
        simplified.iter().for_each(|part| append(result, part));
        Ok(wrong.len())
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
            return Part::new((submesh, self.areas[part]));
        };
        let mut lengths = vec![1.0; submesh.vertices.len()];
        let mut area = 0.0;
        for (k, t) in self.triangles[part].iter().enumerate() {
            let at_corners = sizes.at_corners(*t);
            submesh.triangles[k].iter().zip(at_corners).for_each(|(v, length)| lengths[*v as usize] = length);
            area += submesh.triangle_area(k) * sizes.density(*t as usize);
        }
        Part { lengths, ..Part::new((submesh, area)) }
    }

    /// The whole surface simplified.
    ///
    /// # Errors
    /// [`Error::Usage`] with the least number of vertices if there are too few, [`Error::Cancelled`].
    pub fn simplify(&self, surface: &TriMesh, target: &SimplifyTarget) -> Result<TriMesh> {
        let submeshes = self.submeshes(surface);
        let parts: Vec<Part> = (submeshes.iter().enumerate())
            .map(|(part, submesh)| self.sized_part(submesh, part, target.sizes))
            .collect();
        let mut result = TriMesh::default();
        simplify_all(&parts, target)?.iter().for_each(|part| append(&mut result, part));
        Ok(result)
    }
}

/// A component to be simplified.
struct Part<'a> {
    surface: &'a TriMesh,
    /// By which the vertices are shared out: more than the area where edges are shorter.
    area: f64,
    /// The relative target length at each vertex; empty if they are all equal.
    lengths: Vec<f64>,
    /// Where its vertices should be; empty if anywhere.
    sites: Vec<Site>,
}

impl<'a> Part<'a> {
    fn new((surface, area): (&'a TriMesh, f64)) -> Self {
        Self { surface, area, lengths: Vec::new(), sites: Vec::new() }
    }
}

/// The simplified components, each with its share of the vertices, or with more if a small one needs them.
///
/// # Errors
/// [`Error::Usage`] with the least number of vertices if there are too few, [`Error::Cancelled`].
fn simplify_all(parts: &[Part], target: &SimplifyTarget) -> Result<Vec<TriMesh>> {
    let simplify = |counts: &[usize]| -> Result<Vec<TriMesh>> {
        let each = parts.iter().zip(counts);
        each.map(|(part, count)| {
            let wanted = (part.lengths.as_slice(), part.sites.as_slice());
            simplified_and_polished(part.surface, wanted, &target.with_vertices(*count))
        })
        .collect()
    };
    let fits = |meshes: &[TriMesh], counts: &[usize]| {
        meshes.iter().zip(counts).all(|(mesh, count)| mesh.vertices.len() == *count)
    };
    let counts = vertices_by_area(parts, &vec![0; parts.len()], target.vertices);
    let meshes = simplify(&counts)?;
    if fits(&meshes, &counts) {
        return Ok(meshes);
    }
    let counts = vertices_above_least(parts, target)?;
    let meshes = simplify(&counts)?;
    if fits(&meshes, &counts) {
        return Ok(meshes);
    }
    // With given sites or sharp edges, the least number of vertices is not always reached.
    Err(too_few(target.vertices, parts.len(), 2 * target.vertices))
}

/// Vertices for each component: the least number that it needs, and a share of the others by area.
///
/// # Errors
/// [`Error::Usage`] with the least number of vertices if there are too few, [`Error::Cancelled`].
fn vertices_above_least(parts: &[Part], target: &SimplifyTarget) -> Result<Vec<usize>> {
    let none = target.with_vertices(0);
    let least = |part: &Part| simplified(part.surface, &[], &none).map(|least| least.mesh.vertices.len());
    let least: Vec<usize> = parts.iter().map(least).collect::<Result<_>>()?;
    let needed: usize = least.iter().sum();
    if needed > target.vertices {
        return Err(too_few(target.vertices, parts.len(), needed));
    }
    Ok(vertices_by_area(parts, &least, target.vertices))
}

/// `count` vertices in all: `least` for each component, and the rest by area, as evenly as whole numbers can
/// be.
fn vertices_by_area(parts: &[Part], least: &[usize], count: usize) -> Vec<usize> {
    let rest = count - least.iter().sum::<usize>();
    let whole: f64 = parts.iter().map(|part| part.area).sum();
    let mut passed = 0.0;
    let mut given = 0;
    let next = |(part, least): (&Part, &usize)| {
        passed += part.area / whole;
        let upto = ((passed * rest as f64).round() as usize).clamp(given, rest);
        let own = least + upto - given;
        given = upto;
        own
    };
    let mut counts: Vec<usize> = parts.iter().zip(least).map(next).collect();
    if let Some(last) = counts.last_mut() {
        *last += rest - given;
    }
    counts
}

fn too_few(count: usize, components: usize, needed: usize) -> Error {
    Error::usage(
        format!("{count} vertices are too few for the {components} components of this surface"),
        format!("ask for more vertices, {needed} would do"),
    )
}
