//! What becomes of colours, texture coordinates and labels on the command line.

use rtfmesh::io::{Format, Loaded};
use rtfmesh::mesh::attributes::{Attributes, label_borders, transfer, uv_seams};
use rtfmesh::mesh::repair::{RepairOptions, at_welded_places};
use rtfmesh::{CorrespondenceRequest, Error, Method, Options, Remeshed, TriMesh};

/// Which attributes a result gets from its input.
#[derive(clap::Args)]
pub struct AttributeArgs {
    /// Carry no colours, normals, texture coordinates, labels or other attributes over to the result
    #[arg(long, conflicts_with_all = ["keep_uv", "keep_labels"])]
    no_attributes: bool,
    /// Keep the seams of the texture as curves, so that each face lies in one piece of it; from glTF to GLB also the
    /// materials and their pictures
    #[arg(long)]
    keep_uv: bool,
    /// Keep the borders between materials, groups and other labels of faces as curves
    #[arg(long)]
    keep_labels: bool,
}

impl AttributeArgs {
    /// Curves are kept by the default method alone.
    ///
    /// # Errors
    /// [`Error::Usage`] that names the option.
    pub fn check(&self, method: Method) -> rtfmesh::Result<()> {
        let given = [("--keep-uv", self.keep_uv), ("--keep-labels", self.keep_labels)];
        match given.iter().find(|(_, given)| *given && method != Method::CoarseToFine) {
            None => Ok(()),
            Some((name, _)) => Err(Error::usage(
                format!("{name} is an option of preset default alone"),
                "leave it out, or add --preset default",
            )),
        }
    }

    /// Whether materials are to be read and written.
    pub fn wants_materials(&self) -> bool {
        self.keep_uv
    }

    /// Asks a run for what carrying over to a file of this format takes; tells what cannot be kept.
    pub fn ask(&self, loaded: &Loaded, format: Option<Format>, options: &mut Options) -> Vec<String> {
        let Loaded { mesh, attributes, .. } = loaded;
        options.correspondence = match self.no_attributes || format == Some(Format::Stl) {
            true => CorrespondenceRequest::NONE,
            false => attributes.required_correspondence(),
        };
        options.coarse_to_fine.fixed_half_edges.clear();
        let mut notes = Vec::new();
        // Edges that a crack parts are seams and borders once it is closed. What cannot be mended the run itself tells.
        let welding = options.weld > 0.0 && (self.keep_uv || self.keep_labels);
        let repair = RepairOptions { weld: options.weld, min_component: 0.0 };
        let welded = welding.then(|| at_welded_places(mesh, &repair).ok()).flatten();
        let mesh = welded.as_ref().unwrap_or(mesh);
        if self.keep_uv {
            options.coarse_to_fine.fixed_half_edges.extend(uv_seams(mesh, attributes));
            if attributes.uv.is_none() {
                notes.push("there are no texture coordinates whose seams could be kept".to_owned());
            }
        }
        if self.keep_labels {
            let borders = label_borders(mesh, attributes);
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
