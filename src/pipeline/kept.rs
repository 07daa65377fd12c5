//! Triangles that stay as they are: cut off before a run, and joined to its result.

use super::pinned::edge_keys;
use super::refined::refined_vertices;
use crate::grammar::counted;
use crate::mesh::bvh::{Bvh, Closest};
use crate::mesh::correspondence::{Correspondence, SurfacePoint};
use crate::mesh::features::FeatureLine;
use crate::mesh::half_edges::{EdgeTable, edge_key};
use crate::mesh::insert_points::{FAR, NEAR};
use crate::mesh::position_key;
use crate::mesh::repair::Repaired;
use crate::mesh::submesh::extract;
use crate::mesh::topology::{Partition, Topology, topology};
use crate::mesh::unit_frame::UnitFrame;
use crate::options::{FeatureLines, Length, Options, Refinement, Shortage, Size};
use crate::{Error, Result, TriMesh};
use glam::DVec3;
use std::collections::{HashMap, HashSet};

/// Largest share of the other vertices that may be next to kept triangles, as for all that is kept.
const MOST_SHARED: f64 = 0.6;

/// The triangles that stay, and how the rest of the mesh is attached to them.
#[derive(Debug)]
pub(crate) struct Kept {
    /// The mesh of these triangles.
    mesh: TriMesh,
    /// Which of the input each of them is.
    origin: Vec<u32>,
    /// How many of them are as in the input, and how many that were to stay are not, or not there at all:
    /// repair turned, merged or removed them.
    unchanged: usize,
    changed: usize,
    /// The repaired input with them and its topology.
    pub whole: Repaired,
    pub topology: Topology,
    /// The vertices that the rest has, too, by the rest's numbers, rising.
    pub shared: Vec<u32>,
    /// Its edges that are those of kept triangles, too, each with how many triangles it has there.
    pub cut: Vec<((u32, u32), usize)>,
    /// Where the vertices of the rest are.
    places: Vec<DVec3>,
    /// The user's lines in the rest.
    pub lines: Option<FeatureLines>,
    /// The user's points in the rest.
    pub points: Vec<DVec3>,
}

impl Kept {
    /// Leaves in `repaired`, which was made from `input`, what does not stay; `None` if the options name no
    /// triangles. Parts of the rest without a vertex of their own stay as well.
    ///
    /// # Errors
    /// [`Error::Usage`] for triangles that the input does not have, if all of them stay, and for points in
    /// them; those of the user's lines.
    pub fn cut_off(repaired: &mut Repaired, options: &Options, input: &TriMesh) -> Result<Option<Self>> {
        let (wanted, triangles) = (&options.coarse_to_fine.keep, input.triangles.len());
        if wanted.is_empty() {
            return Ok(None);
        }
        if let Some(wrong) = wanted.iter().find(|t| **t as usize >= triangles) {
            let problem = format!("`keep` names triangle {wrong}, and there are {triangles}");
            return Err(Error::option("keep", problem, "name triangles of the input, from 0"));
        }
        let wanted: HashSet<u32> = wanted.iter().copied().collect();
        let mut stays: Vec<bool> = repaired.origin.iter().map(|t| wanted.contains(t)).collect();
        let mesh = &repaired.mesh;
        let table = EdgeTable::new(&mesh.triangles);
        keep_islands(mesh, &table, &mut stays);
        let (own, others): (Vec<u32>, Vec<u32>) =
            (0..mesh.triangles.len() as u32).partition(|t| stays[*t as usize]);
        if own.is_empty() {
            let remedy = "keep others, or leave out what removes them";
            return Err(Error::option("keep", "repair removes all triangles that are kept", remedy));
        }
        if others.is_empty() {
            let problem = match repaired.origin.iter().all(|t| wanted.contains(t)) {
                true => "all triangles are kept",
                false => "the triangles that are not kept have no vertices of their own, so nothing can move",
            };
            return Err(Error::option("keep", problem, "keep fewer triangles"));
        }
        let rest = extract(mesh, &others);
        let [in_kept, in_rest] = [&own, &others].map(|list| of_vertices(mesh, list));
        // The rest has its vertices in the same order.
        let number: Vec<u32> = in_rest
            .iter()
            .scan(0, |next, is| Some(std::mem::replace(next, *next + u32::from(*is))))
            .collect();
        let both = |v: usize| in_kept[v] && in_rest[v];
        let shared = (0..in_kept.len()).filter(|v| both(*v)).map(|v| number[v]).collect();
        let mut cut = Vec::new();
        for sides in table.edges() {
            let count = sides.iter().filter(|side| !stays[side.triangle()]).count();
            if count > 0 && count < sides.len() {
                let (a, b) = sides[0].ends();
                cut.push((edge_key(number[a as usize], number[b as usize]), count));
            }
        }
        let lines = match &options.coarse_to_fine.features {
            None => None,
            Some(lines) => Some(lines_of(lines, mesh, &rest)?),
        };
        let origin_of = |list: &[u32]| list.iter().map(|t| repaired.origin[*t as usize]).collect();
        let (origin, rest_origin): (Vec<u32>, Vec<u32>) = (origin_of(&own), origin_of(&others));
        let is_unchanged = |(t, origin): (&u32, &u32)| {
            corner_keys(mesh.corners(*t as usize)) == corner_keys(input.corners(*origin as usize))
        };
        let unchanged: Vec<u32> =
            own.iter().zip(&origin).filter(|pair| is_unchanged(*pair)).map(|(_, origin)| *origin).collect();
        let kept = Self {
            mesh: extract(mesh, &own),
            changed: wanted.len() - unchanged.iter().filter(|t| wanted.contains(t)).count(),
            unchanged: unchanged.len(),
            origin,
            topology: topology(mesh),
            shared,
            cut,
            places: rest.vertices.clone(),
            lines,
            points: points_of(&options.coarse_to_fine.points, mesh, [&own, &others])?,
            whole: repaired.clone(),
        };
        (repaired.mesh, repaired.origin) = (rest, rest_origin);
        Ok(Some(kept))
    }

    /// What is to be said of them.
    pub fn remark(&self) -> String {
        let count = counted(self.unchanged, ["triangle of the input is", "triangles of the input are"]);
        let text = format!("{count} kept as they are");
        match self.changed {
            0 => text,
            changed => {
                let others = counted(changed, ["other is not", "others are not"]);
                format!("{text}; {others}: repair turned, merged or removed what was to be kept")
            }
        }
    }

    /// The mesh of the triangles that stay.
    pub fn part(&self) -> Repaired {
        let mut part = self.whole.clone();
        (part.mesh, part.origin) = (self.mesh.clone(), self.origin.clone());
        part
    }

    /// Triangles that stay.
    pub fn triangles(&self) -> usize {
        self.mesh.triangles.len()
    }

    /// Their vertices that the rest does not have.
    pub fn own_vertices(&self) -> usize {
        self.mesh.vertices.len() - self.shared.len()
    }

    /// The least number of vertices of the rest.
    pub fn least_of_rest(&self) -> usize {
        ((self.shared.len() as f64 / MOST_SHARED).ceil() as usize).max(4)
    }

    /// The vertices of the rest if there are so many in all, or the least number if more may be added.
    ///
    /// # Errors
    /// [`Error::Usage`] if that is too few.
    pub fn rest_of(&self, vertices: usize, shortage: Shortage) -> Result<usize> {
        let least = self.own_vertices() + self.least_of_rest();
        if vertices >= least || shortage == Shortage::AddVertices {
            return Ok(vertices.max(least) - self.own_vertices());
        }
        let own = self.mesh.vertices.len();
        let problem = match own >= vertices {
            true => format!("the triangles of `keep` alone have {own} vertices, and there are {vertices}"),
            false => format!(
                "the triangles of `keep` have {own} vertices, which leaves too few of {vertices} for the rest"
            ),
        };
        Err(Error::option("vertices", problem, format!("ask for at least {least}, or keep fewer triangles")))
    }

    /// An error about the rest's number of vertices, with what that is.
    pub fn of_rest(&self, error: Error) -> Error {
        match error {
            Error::Usage { problem, remedy, field } if self.own_vertices() > 0 => {
                let own = counted(self.own_vertices(), ["vertex", "vertices"]);
                Error::Usage { problem, remedy: format!("{remedy} (not counting {own} of `keep`)"), field }
            }
            error => error,
        }
    }

    /// Adds the kept triangles to the result of the rest, in which `found` are vertices with the positions
    /// that they have had before.
    ///
    /// # Errors
    /// [`Error::Input`] if it is not the same next to them.
    pub fn join(&self, result: &mut TriMesh, found: &[(usize, DVec3)]) -> Result<()> {
        let at: HashMap<[u64; 3], u32> =
            found.iter().map(|(v, position)| (position_key(*position), *v as u32)).collect();
        let lost = || {
            let problem = "the rest of the surface could not be joined to the triangles of `keep`";
            let remedy = "keep fewer or more triangles, so that no small parts are left between kept ones";
            Error::input(None, problem, remedy)
        };
        let mut of_rest: HashMap<u32, u32> = HashMap::with_capacity(self.shared.len());
        for v in &self.shared {
            let place = self.places[*v as usize];
            let there = *at.get(&position_key(place)).ok_or_else(lost)?;
            result.vertices[there as usize] = place;
            of_rest.insert(*v, there);
        }
        let table = EdgeTable::new(&result.triangles);
        let sides: HashMap<(u32, u32), usize> =
            table.edges().map(|sides| (sides[0].ends(), sides.len())).collect();
        let is_there = |((a, b), count): &((u32, u32), usize)| {
            sides.get(&edge_key(of_rest[a], of_rest[b])).is_some_and(|sides| sides == count)
        };
        if !self.cut.iter().all(is_there) {
            return Err(lost());
        }
        let places = self.shared.iter().map(|v| (position_key(self.places[*v as usize]), of_rest[v]));
        let shared: HashMap<[u64; 3], u32> = places.collect();
        let mut next = result.vertices.len() as u32;
        let mut number = Vec::with_capacity(self.mesh.vertices.len());
        for position in &self.mesh.vertices {
            let known = shared.get(&position_key(*position)).copied();
            number.push(known.unwrap_or(next));
            if known.is_none() {
                result.vertices.push(*position);
                next += 1;
            }
        }
        let own = self.mesh.triangles.iter().map(|t| t.map(|v| number[v as usize]));
        result.triangles.extend(own);
        Ok(())
    }

    /// Sets the places of the kept triangles, the last ones of a result, and of their vertices on the input:
    /// they are exactly there.
    pub fn set_places(&self, on: &mut Correspondence, input: &TriMesh, result: &TriMesh) {
        let first = result.triangles.len() - self.mesh.triangles.len();
        for (t, origin) in (first..).zip(&self.origin) {
            if let Some(place) = on.faces.get_mut(t) {
                *place = SurfacePoint { triangle: *origin, barycentric: [1.0 / 3.0; 3] };
            }
            let corners = input.corners(*origin as usize);
            for v in result.triangles[t].map(|v| v as usize) {
                let Some(place) = on.vertices.get_mut(v) else { continue };
                let distance = |k: &usize| corners[*k].distance_squared(result.vertices[v]);
                let nearest = (0..3).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
                let mut barycentric = [0.0; 3];
                barycentric[nearest] = 1.0;
                *place = SurfacePoint { triangle: *origin, barycentric };
            }
        }
    }
}

/// Whether each vertex of a mesh is one of these triangles.
fn of_vertices(mesh: &TriMesh, triangles: &[u32]) -> Vec<bool> {
    let mut is_one = vec![false; mesh.vertices.len()];
    triangles.iter().flat_map(|t| mesh.triangles[*t as usize]).for_each(|v| is_one[v as usize] = true);
    is_one
}

/// The corners of a triangle, from the least on.
fn corner_keys(corners: [DVec3; 3]) -> [[u64; 3]; 3] {
    let mut keys = corners.map(position_key);
    while keys[0] > keys[1] || keys[0] > keys[2] {
        keys.rotate_left(1);
    }
    keys
}

/// Keeps parts of the rest, connected by edges, all of whose vertices are on kept triangles: nothing in them
/// could move.
fn keep_islands(mesh: &TriMesh, table: &EdgeTable, stays: &mut [bool]) {
    let own: Vec<u32> = (0..stays.len() as u32).filter(|t| stays[*t as usize]).collect();
    let in_kept = of_vertices(mesh, &own);
    let mut parts = Partition::new(stays.len());
    for sides in table.edges() {
        let mut others = sides.iter().map(|side| side.triangle()).filter(|t| !stays[*t]);
        if let Some(first) = others.next() {
            others.for_each(|t| parts.join(first as u32, t as u32));
        }
    }
    let mut is_free = vec![false; stays.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        is_free[parts.root(t as u32) as usize] |= triangle.iter().any(|v| !in_kept[*v as usize]);
    }
    for t in 0..stays.len() {
        stays[t] |= !is_free[parts.root(t as u32) as usize];
    }
}

/// The pieces of the user's lines along edges of the rest of a mesh.
fn lines_of(lines: &FeatureLines, mesh: &TriMesh, rest: &TriMesh) -> Result<FeatureLines> {
    let edges = super::user_curves::drawn(mesh, lines)?;
    let key = |mesh: &TriMesh, ends: [u32; 2]| edge_keys(ends.map(|v| mesh.vertices[v as usize]));
    let sides = rest.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let there: HashSet<_> = sides.map(|ends| key(rest, ends)).collect();
    let own = edges.into_iter().filter(|ends| there.contains(&key(mesh, *ends)));
    let line =
        |ends: [u32; 2]| FeatureLine { line: 1, points: ends.map(|v| mesh.vertices[v as usize]).to_vec() };
    Ok(FeatureLines { file: lines.file.clone(), lines: own.map(line).collect() })
}

/// The points that are not those of triangles that stay, `own` ones of a mesh, but of the others; those that
/// are vertices of the former are there already.
///
/// # Errors
/// [`Error::Usage`] for a point in a triangle that stays.
fn points_of(points: &[DVec3], mesh: &TriMesh, [own, others]: [&[u32]; 2]) -> Result<Vec<DVec3>> {
    if points.is_empty() {
        return Ok(Vec::new());
    }
    let frame = UnitFrame::of(mesh)?;
    let unit = mesh.vertices.iter().map(|p| frame.to_unit(*p)).collect();
    let unit = TriMesh { vertices: unit, triangles: mesh.triangles.clone() };
    let parts = [own, others].map(|list| extract(&unit, list));
    let trees = parts.each_ref().map(Bvh::new);
    let mut of_others = Vec::new();
    for point in points {
        let at = frame.to_unit(*point);
        let [found, other] = trees.each_ref().map(|tree| tree.closest(at));
        let distance = |found: Option<Closest>| found.map_or(f64::INFINITY, |found| found.distance_sq.sqrt());
        let Some(found) =
            found.filter(|_| distance(found) <= FAR && distance(found) + NEAR < distance(other))
        else {
            of_others.push(*point);
            continue;
        };
        if parts[0].corners(found.triangle as usize).iter().all(|corner| corner.distance(at) > NEAR) {
            let DVec3 { x, y, z } = *point;
            let problem = format!("the point ({x}, {y}, {z}) of `points` would lie in a triangle of `keep`");
            let remedy = "leave that point out, or do not keep that triangle";
            return Err(Error::option("points", problem, remedy));
        }
    }
    Ok(of_others)
}

/// The options with lengths in the units of the mesh if only a part of it is remeshed, which has another
/// diagonal.
pub(crate) fn in_units(options: &Options, repaired: &TriMesh) -> Result<Options> {
    if options.coarse_to_fine.keep.is_empty() && options.coarse_to_fine.symmetric.is_none() {
        return Ok(options.clone());
    }
    let scale = UnitFrame::of(repaired)?.scale;
    let in_units = |length: Length| match length {
        Length::Units(_) => length,
        Length::OfDiagonal(share) => Length::Units(share * scale),
    };
    let mut options = options.clone();
    let method = &mut options.coarse_to_fine;
    method.min_edge = method.min_edge.map(in_units);
    method.max_edge = method.max_edge.map(in_units);
    method.refine.iter_mut().for_each(|Refinement { length, .. }| *length = in_units(*length));
    Ok(options)
}

/// The number of vertices for this size of the result of `input`, which is `repaired` here: an edge length is
/// that of what is neither kept nor refined.
///
/// # Errors
/// Those of [`Size::vertices`], [`refined_vertices`] and [`Kept::cut_off`].
pub(crate) fn vertices_for(
    size: Size,
    repaired: &Repaired,
    options: &Options,
    input: &TriMesh,
) -> Result<usize> {
    let method = &options.coarse_to_fine;
    let Some(length) = size.length() else { return size.vertices(&repaired.mesh) };
    if method.keep.is_empty() {
        return match method.refine.is_empty() {
            true => size.vertices(&repaired.mesh),
            false => refined_vertices(repaired, options, length),
        };
    }
    size.validate()?;
    let scale = UnitFrame::of(&repaired.mesh)?.scale;
    let (options, length) = (in_units(options, &repaired.mesh)?, length.share_of(scale) * scale);
    let mut rest = repaired.clone();
    let own = Kept::cut_off(&mut rest, &options, input)?.map_or(0, |kept| kept.own_vertices());
    let others = match method.refine.is_empty() {
        true => Size::EdgeLength(length).vertices(&rest.mesh)?,
        false => refined_vertices(&rest, &options, Length::Units(length))?,
    };
    Ok(own + others)
}
