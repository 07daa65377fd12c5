//! Edge lengths that vary over the surface, on the command line.

use super::heading::SIZING;
use super::refine::{Wish, places, wish};
use rtfmesh::mesh::attributes::Attribute;
use rtfmesh::{Error, Length, Options, Size, Sizing};

/// How much longer edges may be one way than the other, by default.
const ASPECT: f64 = 8.0;

/// Edge lengths that vary over the surface.
#[derive(clap::Args)]
#[command(next_help_heading = SIZING)]
pub struct SizingArgs {
    /// Edge lengths: auto, uniform, curvature, anisotropic or property:NAME [default: auto]
    ///
    /// auto: equal, but shorter around places that equal edges would miss, such as narrow folds, and on the
    /// fillets and small holes of CAD parts; uniform: equal everywhere, the default with --quality draft;
    /// curvature: shorter where the surface is curved; anisotropic: also longer along the direction in which
    /// it bends least, as along cylinders and fillets; property:NAME: proportional to this vertex attribute.
    /// The preset rtf takes curvature and property:NAME as well.
    #[arg(long, value_name = "HOW", value_parser = how)]
    sizing: Option<How>,
    /// Maximum distance between input and result, e.g. 0.1%; sets the edge lengths
    ///
    /// In input units, or in percent of the diagonal. The distance is certified in both directions. Without
    /// -n, the result has as few vertices as possible, found in several runs; with -n, the distance is as
    /// small as N vertices allow. With --sizing anisotropic, edges are longer one way than the other.
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    max_deviation: Option<Length>,
    /// Edges of this length in a part of the surface; may be given several times
    ///
    /// sphere:X,Y,Z,R=LENGTH: within R of a point; box:X0,Y0,Z0,X1,Y1,Z1=LENGTH: in a box along the axes;
    /// label:NAME=LENGTH: on the triangles of a label, group or material (label:ATTRIBUTE:VALUE for any other
    /// number of triangles). Lengths are in input units or in percent of the diagonal. Around the part they
    /// change by --growth, and with -n the rest gets the vertices that are left. Where parts overlap, the
    /// shortest length counts.
    #[arg(long, value_name = "WHERE=LENGTH", value_parser = wish, conflicts_with = "max_deviation",
        hide_short_help = true)]
    refine: Vec<Wish>,
    /// With --sizing curvature: how strongly curvature shortens edges, 0 to 3 [default: 1]
    ///
    /// With 1, triangles deviate equally far everywhere; with 2, they meet at equal angles everywhere. Above
    /// 1, edges on flat parts may exceed --max-edge.
    #[arg(long, value_name = "G", hide_short_help = true)]
    gradation: Option<f64>,
    /// With --sizing anisotropic: largest ratio of edge lengths in two directions, 1 to 100 [default: 8]
    #[arg(long, value_name = "RATIO", hide_short_help = true)]
    aspect: Option<f64>,
    /// Minimum edge length, in input units or e.g. 0.1% [default: 1/8 of the uniform length]
    #[arg(long, value_name = "LENGTH", value_parser = length, hide_short_help = true)]
    min_edge: Option<Length>,
    /// Maximum edge length, in input units or e.g. 5% [default: 8 times the uniform length]
    #[arg(long, value_name = "LENGTH", value_parser = length, hide_short_help = true)]
    max_edge: Option<Length>,
    /// Maximum growth of the edge length per unit of distance along the surface [default: 0.25]
    #[arg(long, value_name = "SLOPE", hide_short_help = true)]
    growth: Option<f64>,
}

#[derive(Debug, Clone, PartialEq)]
enum How {
    Auto,
    Uniform,
    Curvature,
    Anisotropic,
    Property(String),
}

impl How {
    fn differs(&self) -> bool {
        !matches!(self, Self::Auto | Self::Uniform)
    }
}

fn how(text: &str) -> Result<How, String> {
    match text {
        "auto" => Ok(How::Auto),
        "uniform" => Ok(How::Uniform),
        "curvature" => Ok(How::Curvature),
        "anisotropic" => Ok(How::Anisotropic),
        _ => match text.strip_prefix("property:").filter(|name| !name.is_empty()) {
            Some(name) => Ok(How::Property(name.to_owned())),
            None => Err("give auto, uniform, curvature, anisotropic or property:NAME".to_owned()),
        },
    }
}

pub(super) fn length(text: &str) -> Result<Length, String> {
    match super::target_count::length(text)? {
        Size::RelativeEdgeLength(share) => Ok(Length::OfDiagonal(share)),
        Size::EdgeLength(length) => Ok(Length::Units(length)),
        _ => Err("give a length".to_owned()),
    }
}

impl SizingArgs {
    /// Whether edge lengths are to differ.
    pub fn differs(&self) -> bool {
        self.max_deviation.is_some() || self.sizing.as_ref().is_some_and(How::differs)
    }

    /// Whether edges are to be longer one way than the other.
    pub fn is_anisotropic(&self) -> bool {
        self.sizing == Some(How::Anisotropic)
    }

    /// Whether tangent faces can be weighted by these lengths.
    pub fn suits_weights(&self) -> bool {
        self.max_deviation.is_none() && !self.is_anisotropic()
    }

    /// Puts what was asked for into the options; numbers of the vertices come with [`SizingArgs::values`].
    ///
    /// # Errors
    /// [`Error::Usage`] for options that do nothing.
    pub fn put(&self, options: &mut Options) -> rtfmesh::Result<()> {
        let how = self.sizing.as_ref().unwrap_or(&How::Auto);
        let differ = self.differs() || !self.refine.is_empty();
        let others = "curvature, anisotropic or property:NAME, or --max-deviation, or --refine";
        if self.max_deviation.is_some() && !matches!(self.sizing, None | Some(How::Anisotropic)) {
            let problem = "--max-deviation sets the edge lengths, and so does --sizing";
            return Err(Error::usage(problem, "remove one, or use --sizing anisotropic"));
        }
        let given = [
            ("--gradation", self.gradation.is_some(), *how == How::Curvature, "curvature"),
            ("--aspect", self.aspect.is_some(), *how == How::Anisotropic, "anisotropic"),
            ("--min-edge", self.min_edge.is_some(), differ, others),
            ("--max-edge", self.max_edge.is_some(), differ, others),
            ("--growth", self.growth.is_some(), differ, others),
        ];
        if let Some((name, .., of)) = given.iter().find(|(_, given, does, _)| *given && !does) {
            let problem = format!("{name} needs --sizing {of}");
            return Err(Error::usage(problem, "remove one, or add the other"));
        }
        let sizing = match (&self.sizing, self.max_deviation) {
            (Some(How::Anisotropic), deviation) => {
                Some(Sizing::Anisotropic { aspect: self.aspect.unwrap_or(ASPECT), deviation })
            }
            (_, Some(most)) => Some(Sizing::Deviation(most)),
            // As the quality has it.
            (None, None) => None,
            (Some(How::Auto), None) => Some(Sizing::Automatic),
            (Some(How::Uniform), None) => Some(Sizing::Uniform),
            (Some(How::Curvature), None) => {
                Some(Sizing::Curvature { gradation: self.gradation.unwrap_or(1.0) })
            }
            (Some(How::Property(_)), None) => Some(Sizing::Given(Vec::new())),
        };
        let coarse = &mut options.coarse_to_fine;
        if let Some(sizing) = sizing {
            coarse.sizing = sizing;
        }
        (coarse.min_edge, coarse.max_edge) = (self.min_edge, self.max_edge);
        coarse.growth = self.growth.unwrap_or(coarse.growth);
        coarse.refine = places(&self.refine);
        Ok(())
    }

    /// The regions of `--refine`.
    pub fn refine(&self) -> &[Wish] {
        &self.refine
    }

    /// The numbers of the vertices among these attributes, if they were asked for.
    ///
    /// # Errors
    /// [`Error::Input`] if the mesh has none of that name.
    pub fn values<'a>(&self, vertex: &'a [Attribute]) -> rtfmesh::Result<Option<&'a [f64]>> {
        let Some(How::Property(name)) = &self.sizing else { return Ok(None) };
        let found = vertex.iter().find(|a| a.name == *name && a.components == 1);
        let Some(found) = found else {
            let others = vertex.iter().filter(|a| a.components == 1).map(|a| a.name.as_str());
            let others: Vec<&str> = others.collect();
            let problem = format!("the vertices have no numeric attribute '{name}'");
            let remedy = if others.is_empty() {
                "use a file whose vertices have such an attribute, for example a PLY property".to_owned()
            } else {
                format!("use one of these: {}", others.join(", "))
            };
            return Err(Error::input(None, problem, remedy));
        };
        Ok(Some(&found.values))
    }
}
