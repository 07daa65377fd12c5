//! The algebraic sphere that fits weighted points with normals.

use glam::DVec3;

/// Weighted sums over points.
#[derive(Clone, Copy, Default)]
pub(super) struct Sums {
    pub weight: f64,
    pub at: DVec3,
    radius: f64,
    normal: DVec3,
    /// Of products of places and normals, and of places with themselves.
    flux: f64,
    square: f64,
}

/// An algebraic sphere: where `value + slope . x + bend x . x` is 0.
#[derive(Clone, Copy)]
pub(super) struct Sphere {
    value: f64,
    slope: DVec3,
    bend: f64,
}

impl Sums {
    /// A point with its weight, the radius within which points have one, and a normal of length 1.
    pub fn add(&mut self, weight: f64, radius: f64, at: DVec3, normal: DVec3) {
        self.weight += weight;
        self.radius += weight * radius;
        self.at += weight * at;
        self.normal += weight * normal;
        self.flux += weight * at.dot(normal);
        self.square += weight * at.length_squared();
    }

    /// The sphere that fits best.
    pub fn sphere(&self) -> Sphere {
        let centre = self.at / self.weight;
        let normal = self.normal / self.weight;
        let radius = self.radius / self.weight;
        let spread = self.square / self.weight - centre.length_squared();
        let bend = 0.5 * (self.flux / self.weight - centre.dot(normal)) / spread.max(f64::MIN_POSITIVE);
        // A sphere smaller than the weights' own radius comes from noise, and its other side is near.
        let bend = if spread > 0.0 { bend.clamp(-0.5 / radius, 0.5 / radius) } else { 0.0 };
        let slope = normal - 2.0 * bend * centre;
        Sphere { value: -slope.dot(centre) - bend * self.square / self.weight, slope, bend }
    }
}

impl Sphere {
    /// The signed distance of a place, positive outside.
    pub fn distance(&self, at: DVec3) -> f64 {
        let value = self.value + self.slope.dot(at) + self.bend * at.length_squared();
        let slope = self.slope + 2.0 * self.bend * at;
        let root = (slope.length_squared() - 4.0 * self.bend * value).max(0.0).sqrt();
        2.0 * value / (slope.length() + root).max(f64::MIN_POSITIVE)
    }
}
