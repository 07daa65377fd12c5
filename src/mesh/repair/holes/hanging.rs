//! Small parts of a surface that hang in a hole by a vertex, as scans have them.

use crate::mesh::TriMesh;
use crate::mesh::half_edges::EdgeTable;
use crate::mesh::repair::components::keep_triangles;
use crate::mesh::topology::Partition;

/// A part hangs if its area is below this share of that of the largest one which it is connected to.
const SMALL: f64 = 0.05;

/// Removes them if they are no larger than `largest` across; returns how many there were. `table` has the
/// edges of the mesh.
pub(super) fn remove(mesh: &mut TriMesh, origin: &mut Vec<u32>, largest: f64, table: &EdgeTable) -> usize {
    let count = mesh.triangles.len();
    let (mut parts, mut wholes) = (Partition::new(count), Partition::new(mesh.vertices.len()));
    let mut has_boundary = vec![false; count];
    for edge in table.edges() {
        let first = edge[0].triangle();
        has_boundary[first] |= edge.len() == 1;
        edge.iter().for_each(|other| parts.join(first as u32, other.triangle() as u32));
    }
    mesh.triangles.iter().flat_map(|[a, b, c]| [(*a, *b), (*b, *c)]).for_each(|(a, b)| wholes.join(a, b));
    // Of each part, by its root: its area, its bounding box, whether it is open.
    let mut found = vec![Part::default(); count];
    for t in 0..count {
        let part = &mut found[parts.root(t as u32) as usize];
        part.area += mesh.triangle_area(t);
        part.is_open |= has_boundary[t];
        let corners = mesh.corners(t);
        let [low, high] = part.bounds.get_or_insert([corners[0]; 2]);
        corners.into_iter().for_each(|p| (*low, *high) = (low.min(p), high.max(p)));
    }
    let mut most = vec![0.0_f64; mesh.vertices.len()];
    let whole_of: Vec<u32> = mesh.triangles.iter().map(|t| wholes.root(t[0])).collect();
    for t in (0..count).filter(|t| found[*t].bounds.is_some()) {
        let most = &mut most[whole_of[t] as usize];
        *most = most.max(found[t].area);
    }
    let hangs = |t: usize, part: &Part| {
        part.is_open && part.width() <= largest && part.area < SMALL * most[whole_of[t] as usize]
    };
    let removed = (0..count).filter(|t| found[*t].bounds.is_some() && hangs(*t, &found[*t])).count();
    if removed > 0 {
        let roots: Vec<usize> = (0..count as u32).map(|t| parts.root(t) as usize).collect();
        keep_triangles(mesh, origin, |t| !hangs(t, &found[roots[t]]));
    }
    removed
}

/// A part of the surface that is connected by edges.
#[derive(Debug, Clone, Default)]
struct Part {
    area: f64,
    bounds: Option<[glam::DVec3; 2]>,
    is_open: bool,
}

impl Part {
    /// The diagonal of its bounding box.
    fn width(&self) -> f64 {
        self.bounds.map_or(0.0, |[low, high]| high.distance(low))
    }
}
