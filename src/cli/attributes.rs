//! Colours, texture coordinates, labels and other attributes on the command line.

use super::heading::ATTRIBUTES;
use super::job::Notes;
use rtfmesh::io::{Format, Loaded};
use rtfmesh::mesh::attributes::{Attribute, Attributes, Role, label_boundaries, transfer, uv_seams};
use rtfmesh::mesh::repair::{Repaired, repair_with};
use rtfmesh::{CorrespondenceRequest, Error, Method, Options, Remeshed, TriMesh};

/// Which attributes a result gets from its input.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = ATTRIBUTES)]
pub struct AttributeArgs {
    /// Keep texture seams and, in GLB, materials and images
    ///
    /// No triangle crosses a seam then. Materials and images are read from glTF, OBJ and 3MF.
    #[arg(long)]
    keep_uv: bool,
    /// Keep the borders between materials, groups and other labels of triangles; =NAME,NAME: of these alone
    ///
    /// NAME may be any attribute of triangles.
    #[arg(
        long,
        value_name = "NAME",
        num_args = 0..=1,
        require_equals = true,
        value_delimiter = ',',
        default_missing_value = "",
        hide_short_help = true
    )]
    keep_labels: Option<Vec<String>>,
    /// Smooth ragged label borders by at most this many input edges, with --keep-labels [default: 1]
    ///
    /// 0 keeps borders as they are. Sharp edges, boundaries and borders that are not ragged stay.
    #[arg(long, value_name = "EDGES", requires = "keep_labels", hide_short_help = true)]
    smooth_labels: Option<f64>,
    /// Leave out colours, normals, texture coordinates, labels and all other attributes
    #[arg(long, conflicts_with_all = ["keep_uv", "keep_labels"], hide_short_help = true)]
    no_attributes: bool,
}

impl AttributeArgs {
    /// Only the default method keeps curves.
    ///
    /// # Errors
    /// [`Error::Usage`] that names the option.
    pub fn check(&self, method: Method) -> rtfmesh::Result<()> {
        let given = [("--keep-uv", self.keep_uv), ("--keep-labels", self.keep_labels.is_some())];
        match given.iter().find(|(_, given)| *given && method != Method::CoarseToFine) {
            None => Ok(()),
            Some((name, _)) => Err(Error::usage(
                format!("{name} works only with preset default"),
                "remove it, or use --preset default",
            )),
        }
    }

    /// Whether materials are to be read and written.
    pub fn wants_materials(&self) -> bool {
        self.keep_uv
    }

    /// Whether a result is to get none.
    pub fn drops_all(&self) -> bool {
        self.no_attributes
    }

    /// Sets what a run must do for attributes to reach a file of the options' format; adds notes on what
    /// cannot be kept. Returns the repaired input, where it had to be made or is given.
    ///
    /// # Errors
    /// Those of [`repair_with`].
    pub fn request(
        &self,
        loaded: &Loaded,
        repaired: Option<Repaired>,
        options: &mut Options,
        notes: &mut Notes,
    ) -> rtfmesh::Result<Option<Repaired>> {
        let Loaded { mesh, attributes, .. } = loaded;
        options.correspondence = match self.no_attributes {
            true => CorrespondenceRequest::NONE,
            false => attributes.required_correspondence(),
        };
        // Once a crack is closed, its edges can be seams and borders.
        let repaired = match repaired {
            None if self.keep_uv || self.keep_labels.is_some() => {
                Some(repair_with(mesh, &options.repairs())?)
            }
            given => given,
        };
        let welded = repaired.as_ref().and_then(|repaired| repaired.at_welded_places(mesh));
        let mesh = welded.as_ref().unwrap_or(mesh);
        if self.keep_uv {
            options.coarse_to_fine.fixed_half_edges.extend(uv_seams(mesh, attributes));
            if attributes.uv.is_none() {
                notes.add("--keep-uv has no effect: the input has no texture coordinates");
            }
        }
        if let Some(names) = &self.keep_labels {
            let borders = borders(names, mesh, attributes)?;
            let others = unnamed_numbers(names, attributes);
            if borders.is_empty() {
                let why = match attributes.face.iter().any(|own| own.role == Role::Label) {
                    true => "all neighbouring triangles have the same labels",
                    false => "the input has no labels",
                };
                notes.add(format!("--keep-labels has no effect: {why}{others}"));
            } else if !others.is_empty() {
                notes.add(format!("--keep-labels keeps the borders of labels{others}"));
            }
            options.coarse_to_fine.label_borders = borders;
            if let Some(edges) = self.smooth_labels {
                options.coarse_to_fine.smooth_labels = edges;
            }
        } else if attributes.materials.as_ref().is_some_and(|materials| materials.used_count() > 1) {
            notes.add("borders between materials are not kept; --keep-labels keeps them");
        }
        if loaded.unread_images > 0
            && !self.no_attributes
            && options.format.is_some_and(|format| format != Format::Glb)
        {
            notes.add("the texture is not kept: use .glb and --keep-uv");
        }
        Ok(repaired)
    }

    /// The warning that a file of this format lacks a texture which it could hold. Its seams would become
    /// curves with vertices on them, and so the result another one, which nobody gets unasked.
    pub fn texture_warning(&self, loaded: &Loaded, format: Format) -> Option<String> {
        let Loaded { attributes, unread_images, .. } = loaded;
        // Libraries of OBJ files, which are read only for textures.
        let is_named = !attributes.libraries.is_empty() && attributes.uv.is_some();
        let is_unread = *unread_images > 0 || (is_named && !self.keep_uv);
        let is_lost = is_unread && !self.no_attributes && format == Format::Glb;
        let text = "the texture is not kept: --keep-uv keeps it and puts vertices on its seams";
        is_lost.then(|| text.to_owned())
    }
}

/// What to say of whole numbers that are no labels, since they number the triangles, if there are any and no
/// names were given.
fn unnamed_numbers(names: &[String], attributes: &Attributes) -> String {
    let is_number = |own: &&Attribute| own.role == Role::Other && own.kind.range().is_some();
    let single = attributes.face.iter().filter(|own| own.components == 1);
    let others: Vec<&str> = single.filter(is_number).map(|own| own.name.as_str()).collect();
    if others.is_empty() || !names.iter().all(String::is_empty) {
        return String::new();
    }
    let others = others.join(",");
    format!("; {others} counts only if it is named: --keep-labels={others}")
}

/// The half-edges between values of faces with these names; between all labels if there is none.
///
/// # Errors
/// [`Error::Usage`] for a name that no values of faces have.
fn borders(names: &[String], mesh: &TriMesh, attributes: &Attributes) -> rtfmesh::Result<Vec<u32>> {
    if names.iter().all(String::is_empty) {
        return Ok(label_boundaries(mesh, attributes));
    }
    let named = |name: &String| {
        let found = attributes.face_named(name).map(|own| Attribute { role: Role::Label, ..own.clone() });
        found.ok_or_else(|| {
            let there: Vec<&str> = attributes.face.iter().map(|own| own.name.as_str()).collect();
            let there = if there.is_empty() { "no values".to_owned() } else { there.join(", ") };
            let problem = format!("--keep-labels names {name}, and the faces have {there}");
            Error::usage(problem, "give a name that is there, or none for all labels")
        })
    };
    let face = names.iter().filter(|name| !name.is_empty()).map(named).collect::<rtfmesh::Result<_>>()?;
    Ok(label_boundaries(mesh, &Attributes { face, ..Attributes::default() }))
}

/// The input's attributes for the result, if the run was asked for them.
pub fn carry_attributes(mesh: &TriMesh, attributes: &Attributes, result: &Remeshed) -> Attributes {
    match &result.correspondence {
        Some(correspondence) => transfer(attributes, mesh, correspondence, &result.mesh),
        None => Attributes::default(),
    }
}
