//! Edge lengths of a CAD part that are equal but at its bends; see `pipeline/bends.rs`.
//!
//! Two rows of vertices on a fillet leave four times the error of four rows. Few vertices are enough for the
//! additional rows, since most of such a part lies in planes.

use crate::TriMesh;
use crate::mesh::sizing::{SizeField, grown};

/// Edges become as short as to turn by this many radians.
const TURN: f64 = 0.5;
/// Their shortest length, in spacings.
const SHORTEST: f64 = 0.6;
/// If shorter edges take a larger share of the vertices, the shortest length rises by [`STEP`].
const MOST_VERTICES: f64 = 0.2;
/// See [`MOST_VERTICES`].
const STEP: f64 = 0.05;
/// If the shortest length is more than this share of the longest, all are alike.
const ALIKE: f64 = 0.95;
/// Growth of the length per unit of distance.
const GROWTH: f64 = 0.25;

/// The lengths on a surface whose edges are equally long, `spacing`, but at bends; `curvatures` are at its
/// vertices, in the inverse of its unit.
pub(super) fn lengths_at_bends(surface: &TriMesh, curvatures: &[f64], spacing: f64) -> SizeField {
    let most = (1.0 - MOST_VERTICES).powf(-0.5);
    let mut shortest = SHORTEST;
    while shortest < ALIKE {
        let length = |curvature: &f64| spacing * (TURN / (spacing * curvature)).clamp(shortest, 1.0);
        let lengths = grown(surface, curvatures.iter().map(length).collect(), GROWTH);
        let field = SizeField::new(surface.clone(), lengths);
        let [least, largest] = field.range();
        if least > ALIKE * largest {
            break;
        }
        if largest <= most {
            return field;
        }
        shortest += STEP;
    }
    SizeField::default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ProgressToken;
    use crate::mesh::samples::sample;
    use crate::mesh::subdivide::halve_long_edges;

    #[test]
    fn edges_are_shorter_at_bends_and_take_few_vertices() {
        let surface = halve_long_edges(&sample("box").unwrap(), 0.1, 10_000, &ProgressToken::default());
        let surface = surface.unwrap().unwrap();
        let spacing = crate::mesh::spacing(surface.area(), 500);
        let field = |reach: f64, turn: f64| {
            let curvature = |p: &glam::DVec3| if p.x < reach { turn / spacing } else { 0.0 };
            let curvatures: Vec<f64> = surface.vertices.iter().map(curvature).collect();
            lengths_at_bends(&surface, &curvatures, spacing)
        };
        // One side of six turns by so much along an edge.
        for (turn, shortest) in [(0.55, 0.91), (2.0, 0.65)] {
            let [least, largest] = field(0.01, turn).range();
            assert!((least / largest - shortest).abs() < 0.06, "{turn}: {least} {largest}");
            assert!(largest <= 0.8_f64.powf(-0.5), "{turn}: {largest}");
        }
        assert!(field(-1.0, 2.0).is_uniform());
        // If all edges are shorter, none is.
        assert!(field(2.0, 2.0).is_uniform());
    }
}
