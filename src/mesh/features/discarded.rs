//! What became of sharp edges that are not features at the spacing asked for.

use serde::Serialize;

/// Sharp edges that were discarded again, by reason.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Discarded {
    /// Connected components of sharp edges too short to be a feature at this spacing.
    pub short_chains: usize,
    /// Their length in the mesh's units.
    pub short_length: f64,
    /// Dangling chains: short ones with a free end, attached to longer ones.
    #[serde(rename = "twigs")]
    pub dangling_chains: usize,
    /// Their length in the mesh's units.
    #[serde(rename = "twig_length")]
    pub dangling_length: f64,
    /// Patches too narrow for this spacing, or narrow where they end, that lost an edge or two.
    pub strips: usize,
    /// The length of these edges in the mesh's units.
    pub strip_length: f64,
    /// Edges between facets narrower than a spacing, taken for those of a round surface.
    pub facet_edges: usize,
    /// Their length in the mesh's units.
    pub facet_length: f64,
}

impl Discarded {
    /// The length of all but those between facets.
    pub fn length(&self) -> f64 {
        self.short_length + self.dangling_length + self.strip_length
    }

    /// Counts further chains of this length, which would be features, as too short.
    pub(crate) fn give_up(&mut self, chains: usize, length: f64) {
        self.short_chains += chains;
        self.short_length += length;
    }

    /// Multiplies the lengths by `unit`.
    pub(crate) fn in_units(&mut self, unit: f64) {
        let lengths = [
            &mut self.short_length,
            &mut self.dangling_length,
            &mut self.strip_length,
            &mut self.facet_length,
        ];
        for length in lengths {
            *length *= unit;
        }
    }
}
