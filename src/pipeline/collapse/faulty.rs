//! Results that cells got wrong, mended by collapsing edges.

use super::Wish;
use super::components::{Parts, Spread};
use crate::mesh::simplify::Site;
use crate::mesh::spacing;
use crate::pipeline::coarse_to_fine::attempts::{Attempts, Settled};
use crate::pipeline::coarse_to_fine::connect::{crossing_faces, crossing_of_input};
use crate::pipeline::user_curves::has_user_curves;
use crate::pipeline::{Connection, FeatureSummary};
use crate::sites::connect::ConnectCounts;
use crate::{Error, ProgressToken, Result, Sizing};
use std::sync::OnceLock;

impl Attempts<'_> {
    /// A result with its faulty components made anew, with as many vertices; nothing if that does not help.
    /// `crossing` is the number of faces of the input that run through others, once somebody asked.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn mended(
        &self,
        settled: &Settled,
        crossing: &OnceLock<usize>,
        progress: &ProgressToken,
    ) -> Result<Option<Settled>> {
        // Those curves are not known here.
        if has_user_curves(self.options) {
            return Ok(None);
        }
        let begun = &settled.connection;
        let surface = self.surface.mesh();
        let sites = begun.rested.iter().zip(&begun.under);
        let sites: Vec<Site> = sites.map(|(at, triangle)| Site { at: *at, triangle: *triangle }).collect();
        let through = crossing_faces(&begun.mesh, self.frame, progress)?;
        let of_input = crossing_of_input(crossing, self.mesh, progress)?;
        let torn = if through.len() > of_input { through.as_slice() } else { &[] };
        let (wish, parts) = (self.wish(settled.vertices, progress), Parts::new(&surface));
        let made = |spread: Spread| {
            let mut mesh = begun.mesh.clone();
            let mended = parts.mend(&surface, &mut mesh, (&sites, torn), &wish, spread);
            let Some(collapsed) = if_enough(mended)? else { return Ok(None) };
            let left = crossing_faces(&mesh, self.frame, progress)?.len();
            Ok((collapsed > 0 && left <= of_input).then_some((mesh, collapsed, left)))
        };
        let mut found = made(Spread::AsBefore)?;
        // Short edges where faces of the input run through others make more such faces.
        if found.is_none() && self.options.coarse_to_fine.sizing != Sizing::Uniform {
            found = made(Spread::Evenly)?;
        }
        let Some((mesh, collapsed, left)) = found else { return Ok(None) };
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
        Ok(Some(Settled { connection, steps: settled.steps.clone(), ..*settled }))
    }

    /// The whole surface by collapsing edges; nothing if that does not reach so few vertices.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub(crate) fn collapsed(
        &self,
        skeleton: FeatureSummary,
        vertices: usize,
        crossing: &OnceLock<usize>,
        progress: &ProgressToken,
    ) -> Result<Option<Settled>> {
        let surface = self.surface.mesh();
        let parts = Parts::new(&surface);
        let whole = parts.whole(&surface, &self.wish(vertices, progress));
        let Some(mesh) = if_enough(whole)? else { return Ok(None) };
        let left = crossing_faces(&mesh, self.frame, progress)?.len();
        let connection =
            Connection { mesh, collapsed: parts.count(), crossing: Some(left), ..Connection::default() };
        let fits = left <= crossing_of_input(crossing, self.mesh, progress)?;
        Ok(fits.then_some(Settled {
            connection,
            steps: Vec::new(),
            skeleton: Some(skeleton),
            vertices,
            attempts: 1,
        }))
    }

    fn wish<'a>(&self, vertices: usize, progress: &'a ProgressToken) -> Wish<'a> {
        Wish { vertices, ..Wish::of(self.options, spacing(self.surface.area(), vertices), progress) }
    }
}

/// Nothing where the vertices do not suffice.
fn if_enough<T>(made: Result<T>) -> Result<Option<T>> {
    match made {
        Err(Error::Usage { .. }) => Ok(None),
        made => made.map(Some),
    }
}
