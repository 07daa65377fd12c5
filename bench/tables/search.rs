//! The edge length that gives a count of vertices, for programs that take only the former.

/// Searches with few runs, because each takes as long as the run that is measured.
#[derive(Debug)]
pub struct Search {
    wanted: f64,
    /// For all runs, the logarithms of the length and of vertices divided by those wanted.
    tried: Vec<(f64, f64)>,
}

/// Largest accepted deviation from the count, as a share.
pub const TOLERANCE: f64 = 0.02;

/// Most runs of a search.
pub const MOST_RUNS: usize = 8;

impl Search {
    /// A search for `wanted` vertices, at least 1.
    pub fn new(wanted: usize) -> Self {
        Self { wanted: wanted as f64, tried: Vec::new() }
    }

    /// Whether a count of vertices is near enough.
    pub fn will_do(&self, vertices: usize) -> bool {
        (vertices as f64 - self.wanted).abs() <= TOLERANCE * self.wanted
    }

    /// The next length to try after `length` gave `vertices`; `None` if that was near enough or no length
    /// helps.
    pub fn next(&mut self, length: f64, vertices: usize) -> Option<f64> {
        if self.will_do(vertices) || vertices == 0 || self.tried.len() + 1 >= MOST_RUNS {
            return None;
        }
        let now = (length.ln(), (vertices as f64 / self.wanted).ln());
        self.tried.push(now);
        // Between the closest on either side, if both are known: the count need not fall monotonically.
        let many = self.closest(|off| off > 0.0);
        let few = self.closest(|off| off < 0.0);
        let (a, b) = match (many, few) {
            (Some(many), Some(few)) => (many, few),
            // The relation for a surface tiled by equilateral triangles.
            _ => return Some((now.0 + 0.5 * now.1).exp()),
        };
        let between = (a.0 - a.1 * (b.0 - a.0) / (b.1 - a.1)).clamp(a.0.min(b.0), a.0.max(b.0));
        let tried = self.tried.iter().any(|(known, _)| (known - between).abs() < 1e-9);
        (!tried).then(|| between.exp())
    }

    fn closest(&self, side: impl Fn(f64) -> bool) -> Option<(f64, f64)> {
        let on_side = self.tried.iter().filter(|(_, off)| side(*off));
        on_side.min_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).copied()
    }
}
