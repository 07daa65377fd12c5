//! What an iteration does besides where edge lengths vary.

use crate::check::{ROUNDING, unpack_normal};
use crate::context::{Context, Group, Work};
use crate::moves::targets;
use crate::polygons::frame;
use crate::reference::pins::Mark;
use crate::reference::sizing::{RING, Site, drift};
use crate::results::Row;
use anyhow::{Context as _, Result, ensure};
use glam::DVec3;
use rtfmesh::mesh::sizing::SizeField;
use rtfmesh::stages::site_layout::SiteLayout;
use rtfmesh::stages::sizing::{DeviceSizes, Sizing};

/// The target lengths of the sites, and the shift towards shorter ones.
pub const GROUPS: [Group; 1] =
    [Group { kernels: &["sizing.lengths", "sizing.drift"], most_sites: usize::MAX, run: sizing }];

/// Longest step over the target edge length at the site, in spacings.
const LONGEST: f64 = 0.25;

/// Difference in spacings below which the kernel may take one neighbour or the other.
const TIE: f64 = 1e-4;

fn sizing(context: &Context) -> Result<Vec<Row>> {
    let (n, device, it) = (context.len(), context.device, &context.iteration);
    let surface = context.model.surface.mesh();
    // Half to one and a half edge lengths, in a few waves over the surface.
    let lengths = surface.vertices.iter().map(|p| 1.0 + 0.5 * (20.0 * p.x).sin()).collect();
    let field = SizeField::new(surface, lengths);
    let sizes = DeviceSizes::new(device, &field)?.context("the lengths are all the same")?;
    let stage = Sizing::new(device, n, false, SiteLayout::Marked, None)?;
    let wanted = targets(context)?;
    let centroids = it.faces.centroids.to_vec(device)?;
    let largest_move = (LONGEST * context.spacing) as f32;
    let mut record = |recorder: &mut _, _| {
        stage.record_lengths(recorder, &sizes, &it.sites, &it.site_triangle)?;
        let moves = (&it.faces.targets, &it.faces.centroids);
        stage.record_drift(recorder, &it.inputs(), moves, largest_move)
    };
    context.submit(&mut record, 0)?;
    let lengths = stage.lengths.to_vec(device)?;
    let shifted = it.faces.targets.to_vec(device)?;
    let normals = it.normals.normals.to_vec(device)?;
    let site = |i: u32| Site {
        at: context.points[i as usize],
        normal: unpack_normal(normals[i as usize]),
        mark: Mark::Interior(0),
        length: field.at(context.points[i as usize], context.under[i as usize]),
    };
    let mut drifted = 0;
    for (&i, near) in context.samples.iter().zip(&context.near) {
        let own = site(i as u32);
        let off = (f64::from(lengths[i]) - own.length).abs();
        ensure!(off < 1e-4, "site {i}: the length is {off} off");
        let around: Vec<Site> = near.iter().take(RING).map(|j| site(*j)).collect();
        let around: Vec<&Site> = around.iter().collect();
        let far = |k: usize| context.points[near[k] as usize].distance(own.at);
        let is_tie = far(RING) - far(RING - 1) < TIE * context.spacing;
        let drift = drift(&own, &around, frame(own.normal)).filter(|_| !is_tie);
        let Some(drift) = drift else { continue };
        let to = |v: glam::Vec4| v.truncate().as_dvec3();
        let most = f64::from(largest_move) * own.length;
        let want: DVec3 = own.at + (to(wanted[i]) - own.at + drift).clamp_length_max(most);
        let off = to(shifted[i]).distance(want);
        ensure!(off < ROUNDING + 1e-3 * context.spacing, "site {i}: the target is {off} off");
        let step_sq = (to(centroids[i]) + drift).distance_squared(own.at) / own.length.powi(2);
        let off = (f64::from(shifted[i].w) - step_sq).abs();
        ensure!(
            off < 2e-3 * context.spacing.powi(2) + ROUNDING * context.spacing,
            "site {i}: the squared step is {off} off"
        );
        drifted += usize::from(drift.length() > 1e-3 * context.spacing);
    }
    ensure!(2 * drifted > context.samples.len(), "only {drifted} targets are shifted");
    let triangles = n.min(context.model.records.len());
    let works = [
        Work::new("sizing.lengths", n * (16 + 4 + 4) + 16 * triangles),
        Work::new("sizing.drift", n * (16 + 4 + 4 * RING + 4 + 16 + 2 * 16)),
    ];
    context.time(&works, &mut record)
}
