//! Lists of the sites near each site.

use crate::Result;
use crate::gpu::{Buffer, Device};
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
    let on_device = Buffer::from_slice(device, "default.sites", &layout.pack(&sites))?;
    let lists = Lists::new(device, sites.len(), &ListOptions { layout, ..ListOptions::new(LIST) })?;
    let mut recorder = device.recorder()?;
    lists.record_build(&mut recorder, &on_device)?;
    recorder.submit()?;
    lists.neighbours.to_vec(device)
}
