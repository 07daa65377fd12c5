//! Lists of the sites near each site.

use crate::Result;
use crate::gpu::Device;
use crate::gpu::Recorder;
use crate::stages::neighbours::lists::{ListOptions, Lists};
use crate::stages::site_layout::SiteLayout;
use glam::{DVec3, Vec4};

/// Number of sites in a list.
pub(crate) const LIST: u32 = 20;

/// The [`LIST`] nearest sites of each, laid out as [`crate::sites::cells::CellSites::near`].
///
/// # Errors
/// As [`Lists::new`].
pub(crate) fn near_sites(device: &Device, sites: &[DVec3]) -> Result<Vec<u32>> {
    let sites: Vec<Vec4> = sites.iter().map(|p| p.as_vec3().extend(0.0)).collect();
    let layout = SiteLayout::fitting(device, sites.len());
    let on_device = layout.buffer(device, "default.sites", sites.len())?;
    let lists =
        Lists::new(device, sites.len(), &ListOptions { layout, ..ListOptions::in_blocks(device, LIST) })?;
    let mut recorder = Recorder::new(device)?;
    recorder.upload(&on_device, &layout.pack(&sites))?;
    lists.record_build(&mut recorder, &on_device)?;
    let near = lists.neighbours.download(&mut recorder)?;
    let downloads = recorder.submit()?;
    near.map_or_else(|| lists.neighbours.to_vec(device), |near| downloads.read(&near))
}
