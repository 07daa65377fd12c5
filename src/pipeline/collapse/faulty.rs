//! Results that cells got wrong, mended by collapsing edges.

use super::Wish;
use super::components::{Parts, Spread};
use crate::Sizing;
use crate::mesh::intersections::intersecting_faces_until;
use crate::mesh::simplify::Site;
use crate::mesh::spacing;
use crate::pipeline::coarse_to_fine::attempts::{Attempts, Settled};
use crate::pipeline::coarse_to_fine::connect::crossing_faces_until;
use crate::pipeline::user_curves::has_user_curves;
use crate::pipeline::{Connection, FeatureSummary};
use crate::sites::connect::ConnectCounts;
use std::sync::OnceLock;
use std::sync::atomic::AtomicBool;

impl Attempts<'_> {
    /// A result with its faulty components made anew, with as many vertices; nothing if that does not help.
    /// `crossing` is the number of faces of the input that run through others, once somebody asked. It ends
    /// soon, with anything, once it is to `stop`.
    pub(crate) fn mended(
        &self,
        settled: &Settled,
        crossing: &OnceLock<usize>,
        stop: &AtomicBool,
    ) -> Option<Settled> {
        // Those curves are not known here.
        if has_user_curves(self.options) {
            return None;
        }
        let begun = &settled.connection;
        let surface = self.surface.mesh();
        let sites = begun.rested.iter().zip(&begun.under);
        let sites: Vec<Site> = sites.map(|(at, triangle)| Site { at: *at, triangle: *triangle }).collect();
        let through = crossing_faces_until(&begun.mesh, self.frame, stop);
        let torn = if through.len() > self.of_input(crossing, stop) { through.as_slice() } else { &[] };
        let (wish, parts) = (self.wish(settled.vertices, stop), Parts::new(&surface));
        let made = |spread: Spread| {
            let mut mesh = begun.mesh.clone();
            let collapsed = parts.mend(&surface, &mut mesh, (&sites, torn), &wish, spread).ok()?;
            let left = crossing_faces_until(&mesh, self.frame, stop).len();
            (collapsed > 0 && left <= self.of_input(crossing, stop)).then_some((mesh, collapsed, left))
        };
        let sized = self.options.coarse_to_fine.sizing != Sizing::Uniform;
        let again = || if sized { made(Spread::Evenly) } else { None };
        // Short edges where faces of the input run through others make more such faces.
        let (mesh, collapsed, left) = made(Spread::AsBefore).or_else(again)?;
        // Faces that could not be filled were in those components, since a hole changes the topology.
        let counts = ConnectCounts { unfilled_faces: 0, ..begun.counts };
        let connection = Connection {
            mesh,
            counts,
            collapsed,
            crossing: Some(left),
            curve_sites: begun.curve_sites,
            flags: begun.flags,
            edge_lengths: begun.edge_lengths,
            ..Connection::default()
        };
        Some(Settled { connection, steps: settled.steps.clone(), ..*settled })
    }

    /// The whole surface by collapsing edges; nothing if that does not reach so few vertices. It ends soon,
    /// with anything, once it is to `stop`.
    pub(crate) fn collapsed(
        &self,
        skeleton: FeatureSummary,
        vertices: usize,
        crossing: &OnceLock<usize>,
        stop: &AtomicBool,
    ) -> Option<Settled> {
        let surface = self.surface.mesh();
        let parts = Parts::new(&surface);
        let mesh = parts.whole(&surface, &self.wish(vertices, stop)).ok()?;
        let left = crossing_faces_until(&mesh, self.frame, stop).len();
        let connection =
            Connection { mesh, collapsed: parts.count(), crossing: Some(left), ..Connection::default() };
        let fits = left <= self.of_input(crossing, stop);
        fits.then_some(Settled {
            connection,
            steps: Vec::new(),
            skeleton: Some(skeleton),
            vertices,
            attempts: 1,
        })
    }

    fn wish<'a>(&self, vertices: usize, stop: &'a AtomicBool) -> Wish<'a> {
        Wish { vertices, ..Wish::of(self.options, spacing(self.surface.area(), vertices), stop) }
    }

    fn of_input(&self, crossing: &OnceLock<usize>, stop: &AtomicBool) -> usize {
        *crossing.get_or_init(|| intersecting_faces_until(self.mesh, stop).len())
    }
}
