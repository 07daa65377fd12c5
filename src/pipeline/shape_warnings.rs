//! Warnings about the shape of a result: how far it is from the input, and its triangles.

use super::kept::Kept;
use super::missing::farthest_vertex;
use super::result::MetricQuality;
use super::warning::{Warning, WarningCode};
use crate::grammar::counted;
use crate::measure::{Measures, relative_volume, triangle_bounds};
use crate::mesh::bvh::Bvh;
use crate::mesh::feature_distance::folded_edges;
use crate::mesh::forced_angles::ForcedAngles;
use crate::mesh::half_edges::{EdgeTable, HalfEdge};
use crate::mesh::small_angles::{SmallAnglePlace, small_angle_places};
use crate::mesh::topology::{Partition, Topology};
use crate::mesh::triangle::doubled_normal;
use crate::options::{Method, Options};
use crate::{ProgressToken, Result, TriMesh};
use glam::DVec3;
use std::collections::BTreeMap;

/// Distances above this fraction of the input's diagonal are large.
const FAR: f64 = 0.02;
/// Distances above this many mean edges are large.
const FAR_EDGES: f64 = 1.5;
/// Changes of the volume by more than this fraction of it are large.
const VOLUME: f64 = 0.02;
/// Closed surfaces with a smaller volume, relative to that of their bounding box, have hardly any.
const FLAT: f64 = 1e-3;
/// Angles below this many degrees are small where no corner forces them.
const SMALL: f64 = 10.0;
/// Triangles with an angle below 30 degrees are many if they are more than this fraction of all.
const MANY: f64 = 0.02;
/// Creases that turn by less than this many degrees at the median may come from a coarse tessellation: those
/// of a box turn by 90.
const COARSE: f64 = 75.0;
/// Creases may come from a coarse tessellation only if at least this fraction of all sharp edges turns by
/// less than [`COARSE`]; else the part would melt without creases.
const MOSTLY: f64 = 0.8;
/// An edge that turns by more than this many degrees is folded, unless the input is folded nearby.
const FOLDED: f64 = 168.0;
/// The input is folded at an edge that turns by more than this many degrees.
const FOLDED_BEFORE: f64 = 160.0;
/// Components with at most this many vertices are checked for parts that face inwards, although they are no
/// closer to the input that way.
const FEW: usize = 64;
/// A component faces inwards if at least this fraction of its area does.
const INWARDS: f64 = 1.0 / 3.0;

/// A result, next to what it was made from.
#[derive(Clone, Copy)]
pub(crate) struct Shapes<'a> {
    pub options: &'a Options,
    /// The repaired input and its topology.
    pub input: (&'a TriMesh, &'a Topology),
    /// The result, in the same frame, and its measures.
    pub result: (&'a TriMesh, &'a Measures),
    /// The triangles of the result that are kept as they are, its last ones: their angles are the input's.
    pub kept: Option<&'a Kept>,
    /// The triangles in their metric, if lengths depend on the direction.
    pub metric: Option<MetricQuality>,
    /// Edge length of a perfect layout, and the diagonal of the input's bounding box, in the input's units.
    pub spacing: f64,
    pub diagonal: f64,
}

impl Shapes<'_> {
    /// All warnings.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`].
    pub fn warnings(&self, progress: &ProgressToken) -> Result<Vec<Warning>> {
        let list = [
            (WarningCode::Distance, self.distance_warning(progress)?),
            (WarningCode::Volume, self.volume_warning()),
            (WarningCode::SmallAngles, self.angle_warning()),
            (WarningCode::FoldedEdges, self.fold_warning()),
            (WarningCode::FacesInwards, self.inwards_warning()),
        ];
        Ok(list.into_iter().filter_map(|(code, text)| text.map(|text| Warning { code, text })).collect())
    }

    /// If a part of the input is far from the result, or the other way round. What was measured counts;
    /// otherwise vertices of the input are tried, which finds only a lower bound.
    fn distance_warning(&self, progress: &ProgressToken) -> Result<Option<String>> {
        let most = (FAR * self.diagonal).min(FAR_EDGES * self.spacing);
        let (result, measures) = self.result;
        let far = match measures.distances {
            Some(distances) => Some(distances.hausdorff_lower / 100.0 * self.diagonal),
            None => farthest_vertex(self.input.0, result, most, progress)?,
        };
        Ok(far.filter(|far| *far > most).map(|far| {
            let percent = 100.0 * far / self.diagonal;
            format!(
                "parts of the input are up to {percent:.1} % of its diagonal away from the result: ask for \
                 more vertices"
            )
        }))
    }

    /// If the volume of a closed input changes much.
    fn volume_warning(&self) -> Option<String> {
        let (input, topology) = self.input;
        let (result, measures) = self.result;
        let of_result = measures.relative_volume?;
        if topology.boundary_edges > 0 {
            return None;
        }
        let of_input = relative_volume(input);
        if of_input.abs() < FLAT {
            return None;
        }
        let (before, after) = (of_input * self.box_volume(input), of_result * self.box_volume(result));
        let change = (after - before) / before;
        (change.abs() > VOLUME && change > -1.0).then(|| {
            let word = if change > 0.0 { "larger" } else { "smaller" };
            let percent = 100.0 * change.abs();
            format!("the volume is {percent:.1} % {word} than the input's: ask for more vertices")
        })
    }

    /// If triangles are narrow where no corner of the input's shape is the reason.
    fn angle_warning(&self) -> Option<String> {
        let (result, measures) = self.result;
        let quality = &measures.quality;
        if self.options.method != Method::CoarseToFine {
            return None;
        }
        if let Some(metric) = self.metric {
            return (metric.min_angle < SMALL).then(|| {
                format!(
                    "angles fall to {:.1} degrees in the metric of the edge lengths: ask for more vertices, \
                     or a smaller `aspect`",
                    metric.min_angle
                )
            });
        }
        let feature_angle = self.options.coarse_to_fine.feature_angle;
        let below_30 = match self.kept {
            None => quality.fraction_below_30,
            Some(_) => self.small(30.0).len() as f64 / self.made() as f64,
        };
        if below_30 > MANY {
            let (percent, cause) = (100.0 * below_30, self.cause(30.0));
            let which = if self.kept.is_some() { "triangles that are not kept" } else { "triangles" };
            return Some(format!("{percent:.1} % of the {which} have an angle below 30 degrees, {cause}"));
        }
        if quality.min_angle >= SMALL {
            return None;
        }
        let forced = ForcedAngles::of(self.input.0, SMALL, feature_angle);
        let small = forced.unforced(result, SMALL, self.spacing);
        let small = small.into_iter().filter(|t| *t < self.made()).count();
        (small > 0).then(|| {
            let triangles = counted(small, ["triangle has", "triangles have"]);
            format!(
                "{triangles} an angle below {SMALL} degrees away from sharp corners, {}",
                self.cause(SMALL)
            )
        })
    }

    /// How many triangles are not kept ones, the first of the result.
    fn made(&self) -> usize {
        self.result.0.triangles.len() - self.kept.map_or(0, Kept::triangles)
    }

    /// Those of them with angles below `limit` degrees.
    fn small(&self, limit: f64) -> Vec<(usize, SmallAnglePlace)> {
        let found = small_angle_places(self.result.0, limit, self.options.coarse_to_fine.feature_angle);
        found.into_iter().filter(|(t, _)| *t < self.made()).collect()
    }

    /// Why there are angles below `limit` degrees, and what helps.
    fn cause(&self, limit: f64) -> String {
        let (result, _) = self.result;
        let feature_angle = self.options.coarse_to_fine.feature_angle;
        let small = self.small(limit);
        let between = small.iter().filter(|(_, place)| *place != SmallAnglePlace::Elsewhere).count();
        if 2 * between < small.len() {
            return "where features are closer to each other than an edge: ask for more vertices".to_owned();
        }
        let turns = |of: &dyn Fn(usize) -> bool| turns(result, feature_angle, of);
        let mut is_small = vec![false; result.triangles.len()];
        small.iter().for_each(|(t, _)| is_small[*t] = true);
        let all = turns(&|_| true);
        let coarse = all.iter().filter(|turn| **turn < COARSE).count();
        let are_many = small.len() as f64 > MANY * self.made() as f64;
        let mut near = turns(&|t| is_small[t]);
        near.sort_unstable_by(f64::total_cmp);
        let median = near.get(near.len() / 2).copied().filter(|median| *median < COARSE);
        if let Some(median) = median.filter(|_| are_many && coarse as f64 >= MOSTLY * all.len() as f64) {
            return format!(
                "between creases with a median angle of {median:.0} degrees, probably of a coarse \
                tessellation: use `feature_angle` 180 to discard all creases, or ask for more vertices"
            );
        }
        "in strips between sharp edges or boundaries that are narrower than an edge: ask for more vertices"
            .to_owned()
    }

    /// If edges are folded where the input has no such edge.
    fn fold_warning(&self) -> Option<String> {
        let (result, measures) = self.result;
        if measures.folded_edges == 0.0 {
            return None;
        }
        let folded = folded_edges(result, FOLDED);
        if folded.is_empty() {
            return None;
        }
        let input = self.input.0;
        let before = folded_edges(input, FOLDED_BEFORE);
        let vertices =
            before.iter().flat_map(|(a, b)| [*a, *b]).map(|v| input.vertices[v as usize]).collect();
        let triangles = (0..before.len() as u32).map(|k| [2 * k, 2 * k + 1, 2 * k + 1]).collect();
        let tree = Bvh::new(&TriMesh { vertices, triangles });
        let is_new = |(a, b): &&(u32, u32)| {
            let middle = result.vertices[*a as usize].midpoint(result.vertices[*b as usize]);
            tree.closest(middle).is_none_or(|found| found.distance_sq > self.spacing * self.spacing)
        };
        let new = folded.iter().filter(is_new).count();
        (new > 0).then(|| {
            let edges = counted(new, ["edge is folded", "edges are folded"]);
            format!(
                "{edges} by more than {FOLDED:.0} degrees where the input has no such edge: ask for more \
                vertices"
            )
        })
    }

    /// If a closed component of few vertices faces inwards with much of its area, seen from the input.
    fn inwards_warning(&self) -> Option<String> {
        let (result, measures) = self.result;
        if measures.topology.vertices > FEW && measures.topology.components == 1 {
            return None;
        }
        let mut parts = Partition::new(result.vertices.len());
        result.triangles.iter().for_each(|[a, b, c]| {
            parts.join(*a, *b);
            parts.join(*a, *c);
        });
        let roots: Vec<u32> = (0..result.vertices.len() as u32).map(|v| parts.root(v)).collect();
        let mut vertices = vec![0; roots.len()];
        roots.iter().for_each(|root| vertices[*root as usize] += 1);
        let mut faces: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (t, [a, ..]) in result.triangles.iter().enumerate() {
            let root = roots[*a as usize];
            if vertices[root as usize] <= FEW {
                faces.entry(root).or_default().push(t);
            }
        }
        if faces.is_empty() {
            return None;
        }
        let input = self.input.0;
        let tree = Bvh::new(input);
        let inwards = |faces: &Vec<usize>| {
            let (mut inwards, mut all) = (0.0, 0.0);
            for t in faces {
                let corners = result.corners(*t);
                let normal = doubled_normal(corners);
                let Some(found) = tree.closest(corners.into_iter().sum::<DVec3>() / 3.0) else { continue };
                let facing = normal.dot(doubled_normal(input.corners(found.triangle as usize)));
                all += normal.length();
                inwards += if facing < 0.0 { normal.length() } else { 0.0 };
            }
            inwards / all
        };
        let worst = faces.values().map(inwards).filter(|share| *share >= INWARDS).max_by(f64::total_cmp)?;
        let percent = 100.0 * worst;
        Some(format!("{percent:.0} % of a component's area faces inwards: ask for more vertices"))
    }

    /// The volume of the bounding box of a mesh's triangles, in cubes of the diagonal.
    fn box_volume(&self, mesh: &TriMesh) -> f64 {
        let (lo, hi) = triangle_bounds(mesh);
        ((hi - lo) / self.diagonal).element_product()
    }
}

/// The angles in degrees by which a mesh turns at its sharp edges, for those at some of its triangles.
fn turns(mesh: &TriMesh, feature_angle: f64, of: &dyn Fn(usize) -> bool) -> Vec<f64> {
    let least = feature_angle.to_radians().cos();
    let turn = |edge: &[HalfEdge]| {
        let [one, two] = edge else { return None };
        let sides = [one.triangle(), two.triangle()];
        let [n, m] = sides.map(|t| doubled_normal(mesh.corners(t)).normalize_or_zero());
        (sides.into_iter().any(of) && n.dot(m) <= least).then(|| n.angle_between(m).to_degrees())
    };
    EdgeTable::new(&mesh.triangles).edges().filter_map(turn).collect()
}

#[cfg(test)]
mod tests {
    use super::Shapes;
    use crate::measure::measure;
    use crate::mesh::repair::repair;
    use crate::mesh::samples::sample;
    use crate::mesh::topology::topology;
    use crate::{Options, ProgressToken, TriMesh};
    use glam::DVec3;
    use std::f64::consts::PI;

    /// The warnings of distance, volume and angles.
    fn warnings(input: &TriMesh, result: &TriMesh, feature_angle: f64) -> [Option<String>; 3] {
        with_shapes(input, result, feature_angle, |shapes| {
            let distance = shapes.distance_warning(&ProgressToken::default()).unwrap();
            [distance, shapes.volume_warning(), shapes.angle_warning()]
        })
    }

    fn with_shapes<T>(
        input: &TriMesh,
        result: &TriMesh,
        feature_angle: f64,
        warn: impl Fn(&Shapes) -> T,
    ) -> T {
        let (topology, measures) = (topology(input), measure(result, None).unwrap());
        let (lo, hi) = input
            .vertices
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(*p), hi.max(*p)));
        warn(&Shapes {
            options: &Options::new(100).feature_angle(feature_angle),
            input: (input, &topology),
            result: (result, &measures),
            kept: None,
            metric: None,
            spacing: 0.1 * lo.distance(hi),
            diagonal: lo.distance(hi),
        })
    }

    fn scaled(mesh: &TriMesh, by: DVec3) -> TriMesh {
        let vertices = mesh.vertices.iter().map(|p| *p * by).collect();
        TriMesh { vertices, triangles: mesh.triangles.clone() }
    }

    #[test]
    fn a_volume_that_changes_by_more_than_two_percent_is_warned_of_in_any_unit() {
        let input = sample("torus").unwrap();
        for unit in [1e-9, 1.0, 1e9] {
            let input = scaled(&input, DVec3::splat(unit));
            let volume = |by| warnings(&input, &scaled(&input, DVec3::new(1.0, 1.0, by)), 40.0)[1].clone();
            assert!(volume(0.9).unwrap().contains("10.0 % smaller"), "{unit}");
            assert!(volume(1.05).unwrap().contains("5.0 % larger"), "{unit}");
            assert_eq!((volume(1.0), volume(0.99)), (None, None), "{unit}");
        }
    }

    #[test]
    fn a_part_that_is_missing_is_warned_of_although_no_distance_was_measured() {
        let input = sample("two-components").unwrap();
        let half = TriMesh {
            vertices: input.vertices.clone(),
            triangles: input.triangles[..input.triangles.len() / 2].to_vec(),
        };
        let used = repair(&half).unwrap().mesh;
        assert!(warnings(&input, &used, 40.0)[0].as_ref().unwrap().contains("away"));
        assert_eq!(warnings(&input, &input, 40.0)[0], None);
    }

    #[test]
    fn a_small_component_that_faces_inwards_is_warned_of_with_its_share() {
        // A prism of 20 sides.
        let at = |k: u32| DVec3::new((f64::from(k) * 0.1 * PI).cos(), (f64::from(k) * 0.1 * PI).sin(), 0.0);
        let vertices = (0..40).map(|k| at(k % 20) + DVec3::Z * f64::from(k / 20)).collect();
        let sides =
            (0..20).flat_map(|k| [[k, (k + 1) % 20, k + 20], [(k + 1) % 20, (k + 1) % 20 + 20, k + 20]]);
        let ends = (1..19).flat_map(|k| [[0, k + 1, k], [20, k + 20, k + 21]]);
        let input = TriMesh { vertices, triangles: sides.chain(ends).collect() };
        let flipped = |count: usize| {
            let mut mesh = input.clone();
            mesh.triangles.iter_mut().take(count).for_each(|face| face.swap(0, 1));
            mesh
        };
        // The sides have most of the area.
        let many = 30;
        let said = |result: &TriMesh| with_shapes(&input, result, 40.0, |shapes| shapes.inwards_warning());
        assert!(said(&flipped(many)).unwrap().contains("of a component's area"));
        assert_eq!((said(&flipped(5)), said(&input)), (None, None));
        // Next to a large component, too.
        let mut both = flipped(many);
        let large = sample("torus").unwrap();
        let first = both.vertices.len() as u32;
        both.vertices.extend(large.vertices.iter().map(|p| *p + DVec3::splat(100.0)));
        both.triangles.extend(large.triangles.iter().map(|face| face.map(|v| v + first)));
        assert!(said(&both).is_some());
    }

    #[test]
    fn many_narrow_triangles_are_warned_of_with_their_share() {
        let at = |degrees: f64| DVec3::new(degrees.to_radians().cos(), degrees.to_radians().sin(), 0.0);
        let fan = |angles: &[f64]| TriMesh {
            vertices: std::iter::once(DVec3::ZERO).chain(angles.iter().map(|a| at(*a))).collect(),
            triangles: (1..angles.len() as u32).map(|k| [0, k, k + 1]).collect(),
        };
        let many = fan(&[0.0, 5.0, 10.0, 15.0]);
        let said = warnings(&many, &many, 40.0)[2].clone().unwrap();
        assert!(said.contains("100.0 % of the triangles") && said.contains("strips"), "{said}");
        let even = fan(&[0.0, 60.0, 120.0, 180.0]);
        assert_eq!(warnings(&even, &even, 40.0)[2], None);
    }
}
