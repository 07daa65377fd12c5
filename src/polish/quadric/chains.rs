//! Chains of edges along ridges, as curves for passes that keep curves.

use glam::DVec3;
use std::collections::BTreeMap;

use crate::mesh::half_edges::{EdgeSet, EdgeTable, edge_key};
use crate::mesh::polyline::Polyline;
use crate::polish::{ConstrainedMesh, CurveEdge, SlidingCurve};

/// An edge is on a ridge if the mesh turns by more degrees there.
const SHARP: f64 = 35.0;
/// A chain ends where it bends by more degrees.
const BEND: f64 = 50.0;

/// Adds the chains of sharp edges of a mesh to its curves.
pub(crate) fn add_ridges(constrained: &mut ConstrainedMesh) {
    let around = sharp_edges(constrained);
    let points = &constrained.mesh.vertices;
    let mut is_fixed = constrained.fixed.clone();
    is_fixed.resize(points.len(), false);
    let is_node = |v: u32| {
        let bends = || {
            let [a, b] =
                [0, 1].map(|k| (points[around[&v][k] as usize] - points[v as usize]).normalize_or_zero());
            -a.dot(b) < BEND.to_radians().cos()
        };
        is_fixed[v as usize] || around[&v].len() != 2 || bends()
    };
    let nodes: Vec<u32> = around.keys().copied().filter(|v| is_node(*v)).collect();
    let mut chains: Vec<Vec<u32>> = Vec::new();
    let mut done = EdgeSet::new();
    let mut follow = |start: u32, next: u32, is_end: &dyn Fn(u32) -> bool| {
        let mut chain = vec![start, next];
        while let [.., before, at] = chain[..]
            && !is_end(at)
        {
            let Some(onward) = around[&at].iter().copied().find(|w| *w != before) else { break };
            chain.push(onward);
        }
        let first = chain.windows(2).all(|edge| done.insert(edge_key(edge[0], edge[1])));
        if first {
            chains.push(chain);
        }
    };
    for v in &nodes {
        for w in &around[v] {
            follow(*v, *w, &|at| is_node(at));
        }
    }
    // Loops without a node begin anywhere.
    for (v, beside) in &around {
        follow(*v, beside[0], &|at| at == *v || is_node(at));
    }
    let is_loose = |v: &u32| around[v].len() == 1 && !is_fixed[*v as usize];
    chains.retain(|chain| chain.len() > 2 || !chain.iter().any(is_loose));
    let points = points.clone();
    for chain in chains {
        add_chain(constrained, &points, &chain);
    }
}

fn add_chain(constrained: &mut ConstrainedMesh, points: &[DVec3], chain: &[u32]) {
    let curve = constrained.sliding_curves.len() as u32;
    let line = Polyline::new(chain.iter().map(|v| points[*v as usize]).collect(), false);
    let arcs: Vec<f64> = (0..chain.len()).map(|k| line.arc_length_at(k)).collect();
    constrained.fixed.resize(points.len(), false);
    chain.iter().for_each(|v| constrained.fixed[*v as usize] = true);
    let edges = chain.windows(2).zip(arcs.windows(2));
    constrained.curve_edges.extend(edges.map(|(ends, arcs)| CurveEdge {
        ends: [ends[0], ends[1]],
        curve,
        from: arcs[0],
        to: arcs[1],
    }));
    let inner = 1..chain.len() - 1;
    let sliders = inner.map(|k| (chain[k], arcs[k])).collect();
    constrained.sliding_curves.push(SlidingCurve { line, sliders });
}

/// The other ends of the sharp edges at each vertex that has any; edges on curves and between patches are
/// none.
fn sharp_edges(constrained: &ConstrainedMesh) -> BTreeMap<u32, Vec<u32>> {
    let ConstrainedMesh { mesh, patches, .. } = constrained;
    let on_curves = constrained.edge_set();
    let normal = |t: usize| mesh.doubled_normal(t).normalize_or_zero();
    let mut around: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for edge in EdgeTable::new(&mesh.triangles).edges() {
        let [one, other] = edge else { continue };
        let (a, b) = one.ends();
        let [s, t] = [one, other].map(|side| side.triangle());
        let is_inside = patches.is_empty() || patches[s] == patches[t];
        if is_inside && !on_curves.contains(&(a, b)) && normal(s).dot(normal(t)) < SHARP.to_radians().cos() {
            around.entry(a).or_default().push(b);
            around.entry(b).or_default().push(a);
        }
    }
    around
}
