//! The components of the input: how many vertices each gets, and which of them are too small for cells.

use super::{Wish, simplified, spare};
use crate::mesh::repair::connected_components;
use crate::mesh::simplify::Site;
use crate::mesh::submesh::{append, extract};
use crate::mesh::topology::topology;
use crate::{Error, Result, TriMesh};

/// A component with a smaller share of the vertices than this is made by collapsing edges, unless it is the
/// largest.
const SMALL: f64 = 32.0;
/// Vertices that the largest component gets, however many others there are.
const ENOUGH: f64 = 32.0;
/// Vertices of the smallest other component on the coarsest level.
const ON_COARSEST: f64 = 12.0;

/// The components of a mesh, in the unit-diagonal frame.
pub(crate) struct Parts {
    /// The component of each triangle.
    of_triangle: Vec<u32>,
    areas: Vec<f64>,
    /// The triangles of each component.
    triangles: Vec<Vec<u32>>,
}

/// What is too small for cells, and the rest.
pub(crate) struct Divided {
    /// The triangles, by number, that are not in small components.
    pub large: Vec<u32>,
    /// The small components, done.
    pub small: Vec<TriMesh>,
    /// Vertices left for the large ones.
    pub left: usize,
    /// The least that the coarsest level needs.
    pub coarsest: usize,
}

impl Parts {
    pub fn new(mesh: &TriMesh) -> Self {
        let (of_triangle, areas) = connected_components(mesh);
        let mut triangles = vec![Vec::new(); areas.len()];
        (0..).zip(&of_triangle).for_each(|(t, part)| triangles[*part as usize].push(t));
        Self { of_triangle, areas, triangles }
    }

    pub fn count(&self) -> usize {
        self.areas.len()
    }

    /// The area of all.
    pub fn area(&self) -> f64 {
        self.areas.iter().sum()
    }

    /// A component of the mesh by itself.
    fn own(&self, mesh: &TriMesh, part: usize) -> TriMesh {
        extract(mesh, &self.triangles[part])
    }

    /// Makes the small components and counts what is left.
    ///
    /// # Errors
    /// [`Error::Usage`] with the least number of vertices if there are too few, [`Error::Cancelled`].
    pub fn divide(&self, mesh: &TriMesh, wish: &Wish) -> Result<Divided> {
        let whole: f64 = self.areas.iter().sum();
        let share = |part: usize| wish.vertices as f64 * self.areas[part] / whole;
        let largest = (0..self.count()).max_by(|a, b| self.areas[*a].total_cmp(&self.areas[*b])).unwrap_or(0);
        let is_small = |part: usize| part != largest && share(part) < SMALL;
        let make = |vertices: &dyn Fn(usize) -> usize| -> Result<Vec<TriMesh>> {
            let small = (0..self.count()).filter(|part| is_small(*part));
            small
                .map(|part| spare(&self.own(mesh, part), &[], &Wish { vertices: vertices(part), ..*wish }))
                .collect()
        };
        let left = |small: &[TriMesh]| {
            wish.vertices.saturating_sub(small.iter().map(|part| part.vertices.len()).sum())
        };
        let mut small = make(&|part| (share(part).round() as usize).max(3))?;
        let shares: f64 = (0..self.count()).filter(|part| !is_small(*part)).map(share).sum();
        // Small ones get more than their share, but not at any price.
        if !small.is_empty() && (left(&small) as f64) < (0.5 * shares).max(ENOUGH) {
            let own: Vec<TriMesh> = (0..self.count()).map(|part| self.own(mesh, part)).collect();
            let counts = shares_above_least(&own.iter().collect::<Vec<_>>(), &self.areas, wish)?;
            small = make(&|part| counts[part])?;
        }
        let left = left(&small);
        let large: Vec<usize> = (0..self.count()).filter(|part| !is_small(*part)).collect();
        let area: f64 = large.iter().map(|part| self.areas[*part]).sum();
        let smallest = large.iter().map(|part| self.areas[*part]).fold(area, f64::min);
        let coarsest = if large.len() > 1 { (ON_COARSEST * area / smallest) as usize } else { 0 };
        let triangles = (0..).zip(&self.of_triangle).filter(|(_, part)| !is_small(**part as usize));
        Ok(Divided { large: triangles.map(|(t, _)| t).collect(), small, left, coarsest })
    }
}

/// Where the vertices of a component made anew are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Spread {
    /// Where they were.
    AsBefore,
    /// Anywhere.
    Evenly,
}

/// What a result has in each component.
struct Compared {
    /// Whether it is what it should be.
    right: Vec<bool>,
    triangles: Vec<Vec<u32>>,
    vertices: Vec<usize>,
}

impl Parts {
    /// Replaces the components of a result that are not what they are in the surface `mesh`, with as many
    /// vertices in all. `sites` are where its vertices were on the surface, where they stay as far as
    /// possible if `spread` says so; the components of the faces `torn` are replaced as well. How many were
    /// replaced.
    ///
    /// # Errors
    /// [`Error::Usage`] with the least number of vertices if there are too few, [`Error::Cancelled`].
    pub fn mend(
        &self,
        mesh: &TriMesh,
        result: &mut TriMesh,
        (sites, torn): (&[Site], &[u32]),
        wish: &Wish,
        spread: Spread,
    ) -> Result<usize> {
        if self.count() == 1 && torn.is_empty() {
            let got = topology(result);
            if got.vertices == result.vertices.len() && got.matches(&topology(mesh)) {
                return Ok(0);
            }
        }
        let part_of = |v: u32| self.of_triangle[sites[v as usize].triangle as usize] as usize;
        let own: Vec<TriMesh> = (0..self.count()).map(|part| self.own(mesh, part)).collect();
        let Compared { mut right, triangles, vertices } = self.compare(&own, result, &part_of);
        torn.iter().flat_map(|t| result.triangles[*t as usize]).for_each(|v| right[part_of(v)] = false);
        let wrong: Vec<usize> = (0..self.count()).filter(|part| !right[*part]).collect();
        if wrong.is_empty() {
            return Ok(0);
        }
        let kept: usize = (0..self.count()).filter(|part| right[*part]).map(|part| vertices[part]).sum();
        let list: Vec<&TriMesh> = wrong.iter().map(|part| &own[*part]).collect();
        let areas: Vec<f64> = wrong.iter().map(|part| self.areas[*part]).collect();
        // Triangles by their number in their component.
        let mut number = vec![0; self.of_triangle.len()];
        for part in &wrong {
            (0..).zip(&self.triangles[*part]).for_each(|(new, t)| number[*t as usize] = new);
        }
        let own_sites = |part: &usize| {
            let there = (0..).zip(sites).filter(|(v, _)| part_of(*v) == *part);
            there.map(|(_, s)| Site { triangle: number[s.triangle as usize], ..*s }).collect()
        };
        let sites: Vec<Vec<Site>> = match spread {
            Spread::AsBefore => wrong.iter().map(own_sites).collect(),
            Spread::Evenly => Vec::new(),
        };
        let wish = Wish { vertices: result.vertices.len() - kept, ..*wish };
        let made = all(&list, &areas, &sites, &wish)?;
        let keep: Vec<u32> =
            (0..self.count()).filter(|part| right[*part]).flat_map(|part| triangles[part].clone()).collect();
        *result = extract(result, &keep);
        made.iter().for_each(|part| append(result, part));
        Ok(wrong.len())
    }

    /// The components of a result beside those of the surface.
    fn compare(&self, own: &[TriMesh], result: &TriMesh, part_of: &dyn Fn(u32) -> usize) -> Compared {
        let mut triangles = vec![Vec::new(); self.count()];
        let mut right = vec![true; self.count()];
        for (t, triangle) in (0..).zip(&result.triangles) {
            let [a, b, c] = triangle.map(part_of);
            triangles[a].push(t);
            if a != b || b != c {
                [a, b, c].iter().for_each(|part| right[*part] = false);
            }
        }
        let mut vertices = vec![0; self.count()];
        (0..result.vertices.len() as u32).for_each(|v| vertices[part_of(v)] += 1);
        for (part, right) in right.iter_mut().enumerate().filter(|(_, right)| **right) {
            let got = topology(&extract(result, &triangles[part]));
            *right = got.vertices == vertices[part] && got.matches(&topology(&own[part]));
        }
        Compared { right, triangles, vertices }
    }

    /// The whole surface by collapsing edges.
    ///
    /// # Errors
    /// [`Error::Usage`] with the least number of vertices if there are too few, [`Error::Cancelled`].
    pub fn whole(&self, mesh: &TriMesh, wish: &Wish) -> Result<TriMesh> {
        let own: Vec<TriMesh> = (0..self.count()).map(|part| self.own(mesh, part)).collect();
        let made = all(&own.iter().collect::<Vec<_>>(), &self.areas, &[], wish)?;
        let mut result = TriMesh::default();
        made.iter().for_each(|part| append(&mut result, part));
        Ok(result)
    }
}

/// Components with their shares of the vertices, or with more than that for the small ones.
///
/// # Errors
/// [`Error::Usage`] with the least number of vertices if there are too few, [`Error::Cancelled`].
fn all(parts: &[&TriMesh], areas: &[f64], sites: &[Vec<Site>], wish: &Wish) -> Result<Vec<TriMesh>> {
    let make = |counts: &[usize]| -> Result<Vec<TriMesh>> {
        let sites = |part: usize| sites.get(part).map_or(&[][..], Vec::as_slice);
        let wish = |part: usize| Wish { vertices: counts[part], ..*wish };
        (0..parts.len()).map(|part| spare(parts[part], sites(part), &wish(part))).collect()
    };
    let fits = |made: &[TriMesh], counts: &[usize]| {
        made.iter().zip(counts).all(|(mesh, count)| mesh.vertices.len() == *count)
    };
    let counts = shares(areas, &vec![0; parts.len()], wish.vertices);
    let made = make(&counts)?;
    if fits(&made, &counts) {
        return Ok(made);
    }
    let counts = shares_above_least(parts, areas, wish)?;
    let made = make(&counts)?;
    if fits(&made, &counts) {
        return Ok(made);
    }
    // The least is reached on another way than with sites or sharp edges.
    Err(too_few(wish.vertices, parts.len(), 2 * wish.vertices))
}

/// Vertices for each component: the least that it needs, and its share by area of the others.
///
/// # Errors
/// [`Error::Usage`] with the least number of vertices if there are too few, [`Error::Cancelled`].
fn shares_above_least(parts: &[&TriMesh], areas: &[f64], wish: &Wish) -> Result<Vec<usize>> {
    let none = Wish { vertices: 0, ..*wish };
    let least = |part: &&TriMesh| simplified(part, &[], &none).map(|found| found.mesh.vertices.len());
    let least: Vec<usize> = parts.iter().map(least).collect::<Result<_>>()?;
    let needed: usize = least.iter().sum();
    if needed > wish.vertices {
        return Err(too_few(wish.vertices, parts.len(), needed));
    }
    Ok(shares(areas, &least, wish.vertices))
}

/// `count` in all: what is `least` for each, and the rest by area, as evenly as whole numbers can be.
fn shares(areas: &[f64], least: &[usize], count: usize) -> Vec<usize> {
    let rest = count - least.iter().sum::<usize>();
    let whole: f64 = areas.iter().sum();
    let mut passed = 0.0;
    let mut given = 0;
    let next = |(area, least): (&f64, &usize)| {
        passed += area / whole;
        let upto = ((passed * rest as f64).round() as usize).clamp(given, rest);
        let own = least + upto - given;
        given = upto;
        own
    };
    let mut counts: Vec<usize> = areas.iter().zip(least).map(next).collect();
    if let Some(last) = counts.last_mut() {
        *last += rest - given;
    }
    counts
}

fn too_few(count: usize, parts: usize, needed: usize) -> Error {
    Error::usage(
        format!("{count} vertices are too few for the {parts} components of this surface"),
        format!("ask for more vertices, {needed} would do"),
    )
}
