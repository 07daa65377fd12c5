//! Colours, texture coordinates, labels and other attributes on the command line.

use super::heading::ATTRIBUTES;
use rtfmesh::io::{Format, Loaded};
use rtfmesh::mesh::attributes::{Attributes, label_boundaries, transfer, uv_seams};
use rtfmesh::mesh::repair::{RepairOptions, at_welded_places};
use rtfmesh::{CorrespondenceRequest, Error, Method, Options, Remeshed, TriMesh};

/// Which attributes a result gets from its input.
#[derive(clap::Args)]
#[command(next_help_heading = ATTRIBUTES)]
pub struct AttributeArgs {
    /// Keep texture seams; from glTF to GLB also materials and their images
    ///
    /// No face crosses a seam then.
    #[arg(long)]
    keep_uv: bool,
    /// Keep the borders between materials, groups and other labels of faces
    #[arg(long, hide_short_help = true)]
    keep_labels: bool,
    /// Drop colours, normals, texture coordinates, labels and all other attributes
    #[arg(long, conflicts_with_all = ["keep_uv", "keep_labels"], hide_short_help = true)]
    no_attributes: bool,
}

impl AttributeArgs {
    /// Only the default method keeps curves.
    ///
    /// # Errors
    /// [`Error::Usage`] that names the option.
    pub fn check(&self, method: Method) -> rtfmesh::Result<()> {
        let given = [("--keep-uv", self.keep_uv), ("--keep-labels", self.keep_labels)];
        match given.iter().find(|(_, given)| *given && method != Method::CoarseToFine) {
            None => Ok(()),
            Some((name, _)) => Err(Error::usage(
                format!("{name} works only with preset default"),
                "leave it out, or add --preset default",
            )),
        }
    }

    /// Whether materials are to be read and written.
    pub fn wants_materials(&self) -> bool {
        self.keep_uv
    }

    /// Sets what a run must do for attributes to reach a file of this format; returns notes on what cannot be
    /// kept.
    pub fn request(&self, loaded: &Loaded, format: Option<Format>, options: &mut Options) -> Vec<String> {
        let Loaded { mesh, attributes, .. } = loaded;
        options.correspondence = match self.no_attributes || format == Some(Format::Stl) {
            true => CorrespondenceRequest::NONE,
            false => attributes.required_correspondence(),
        };
        options.coarse_to_fine.fixed_half_edges.clear();
        let mut notes = Vec::new();
        // Once a crack is closed, its edges can be seams and borders. The run itself reports what cannot be
        // repaired.
        let welding = options.weld > 0.0 && (self.keep_uv || self.keep_labels);
        let repair = RepairOptions::default().weld(options.weld);
        let welded = welding.then(|| at_welded_places(mesh, &repair).ok()).flatten();
        let mesh = welded.as_ref().unwrap_or(mesh);
        if self.keep_uv {
            options.coarse_to_fine.fixed_half_edges.extend(uv_seams(mesh, attributes));
            if attributes.uv.is_none() {
                notes.push("there are no texture coordinates whose seams could be kept".to_owned());
            }
        }
        if self.keep_labels {
            let borders = label_boundaries(mesh, attributes);
            if borders.is_empty() {
                notes.push("there are no labels whose borders could be kept".to_owned());
            }
            options.coarse_to_fine.fixed_half_edges.extend(borders);
        } else if attributes.materials.as_ref().is_some_and(|materials| materials.used() > 1) {
            notes.push("borders between materials are not kept; --keep-labels keeps them".to_owned());
        }
        notes
    }
}

/// The input's attributes for the result, if the run was asked for them.
pub fn carried(mesh: &TriMesh, attributes: &Attributes, result: &Remeshed) -> Attributes {
    match &result.correspondence {
        Some(correspondence) => transfer(attributes, mesh, correspondence, &result.mesh),
        None => Attributes::default(),
    }
}
