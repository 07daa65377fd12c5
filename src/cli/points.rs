//! What `inspect` says of points without faces, and how `render` draws them.

use crate::grammar::counted;
use rtfmesh::Result;
use rtfmesh::cloud::{CloudSurvey, PointCloud, survey, unoriented_normals};
use rtfmesh::glam::DVec3;
use rtfmesh::io::Loaded;
use rtfmesh::mesh::attributes::Role;
use rtfmesh::picture::Colour;
use rtfmesh::{ProgressToken, TriMesh};
use serde::Serialize;

/// What `inspect` prints of points.
#[derive(Serialize)]
pub struct Inspection {
    notes: Vec<String>,
    attributes: Vec<String>,
    points: usize,
    /// How many of them have a normal.
    normals: usize,
    /// The least and the greatest coordinates.
    bounds: [[f64; 3]; 2],
    /// The median distance between neighbouring points, in the points' unit, as all lengths.
    spacing: f64,
    /// The least and the greatest.
    spacing_range: [f64; 2],
    /// Points at the place of another one.
    duplicates: usize,
    /// Points far from all others, which `remesh` leaves out.
    outliers: usize,
    /// The distance of points from planes through their neighbours; none where points lie on lines.
    noise: Option<f64>,
}

impl Inspection {
    /// # Errors
    /// Those of [`survey`].
    pub fn new(mut loaded: Loaded) -> Result<Self> {
        let (notes, attributes) = (std::mem::take(&mut loaded.notes), loaded.attributes.listed());
        let cloud = PointCloud::from(loaded);
        let found = survey(&cloud, &ProgressToken::default())?;
        Ok(Self {
            notes,
            attributes,
            points: cloud.points.len(),
            normals: cloud.normals.iter().filter(|normal| normal.try_normalize().is_some()).count(),
            bounds: found.bounds.map(|corner| corner.to_array()),
            spacing: found.spacing,
            spacing_range: found.spacing_range,
            duplicates: found.duplicates,
            outliers: found.outliers,
            noise: found.noise,
        })
    }

    pub fn rows(&self) -> Vec<(&'static str, String)> {
        let corner = |corner: [f64; 3]| corner.map(|x| format!("{x:.6}")).join(", ");
        let [low, high] = self.bounds;
        let [least, greatest] = self.spacing_range;
        let normals = match self.normals {
            0 => "none: remesh computes them".to_owned(),
            n if n == self.points => "all points".to_owned(),
            n => format!("of {}: remesh recomputes all", counted(n, ["point", "points"])),
        };
        let noise = self.noise.map(|noise| (noise, noise / self.spacing));
        let noise = match noise {
            None => "-, the points lie on lines".to_owned(),
            Some((noise, share)) if share <= CloudSurvey::CURVATURE => {
                format!("{noise:.3e}, {share:.2} spacings: explained by the curvature")
            }
            Some((noise, share)) => format!("{noise:.3e}, {share:.2} spacings"),
        };
        let mut rows = vec![
            ("points", self.points.to_string()),
            ("minimum coordinates", corner(low)),
            ("maximum coordinates", corner(high)),
            ("spacing: median, range", format!("{:.3e}, {least:.3e} to {greatest:.3e}", self.spacing)),
            ("duplicates, outliers", format!("{}, {}", self.duplicates, self.outliers)),
            ("noise", noise),
            ("normals", normals),
        ];
        rows.extend(self.attributes.iter().map(|attribute| ("attribute", attribute.clone())));
        rows.extend(self.notes.iter().map(|note| ("note", note.clone())));
        rows
    }
}

/// What `render` draws: faces, or points as discs.
pub struct Drawn {
    pub mesh: TriMesh,
    /// The points' own colours.
    pub colours: Vec<Colour>,
    /// The points' normals.
    pub normals: Vec<DVec3>,
    /// Whether the file has them, with their signs.
    pub oriented: bool,
    /// The diameter of discs; `None` for faces.
    pub diameter: Option<f64>,
}

impl Drawn {
    /// # Errors
    /// Those of [`survey`].
    pub fn new(loaded: Loaded) -> Result<Self> {
        if !loaded.mesh.triangles.is_empty() {
            let mesh = loaded.mesh;
            let (colours, normals) = (Vec::new(), Vec::new());
            return Ok(Self { mesh, colours, normals, oriented: false, diameter: None });
        }
        let byte = |share: f64| (255.0 * share.clamp(0.0, 1.0)).round() as u8;
        let colours = loaded.attributes.vertex_role(Role::Colour).map(|colour| {
            let of = |i| {
                let [red, green, blue, _] = colour.unit_colour(i);
                [red, green, blue].map(byte)
            };
            (0..loaded.mesh.vertices.len()).map(of).collect()
        });
        let cloud = PointCloud::from(loaded);
        let progress = &ProgressToken::default();
        let spacing = survey(&cloud, progress)?.spacing;
        let oriented = !cloud.normals.is_empty();
        let normals = if oriented { cloud.normals.clone() } else { unoriented_normals(&cloud, progress)? };
        Ok(Self {
            mesh: TriMesh { vertices: cloud.points, triangles: Vec::new() },
            colours: colours.unwrap_or_default(),
            normals,
            oriented,
            diameter: Some(WIDTH * spacing),
        })
    }
}

/// The diameter of discs, in spacings; those of random points leave gaps of 4 % of the surface.
const WIDTH: f64 = 2.0;
