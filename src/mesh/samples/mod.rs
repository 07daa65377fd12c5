//! Built-in models, so that the program can be tried and tested without files.
//!
//! The same name gives the same mesh each time. The closed ones are manifold and face outward.

mod shapes;
mod tetrahedra;

use glam::DVec3;

use crate::TriMesh;
use crate::{Error, Result};

struct Sample {
    name: &'static str,
    make: fn() -> TriMesh,
}

const NAMES: &[(&str, &str)] = &[
    ("torus", "a torus with uneven triangles, 3,456 of them"),
    ("genus3", "three rings blended into one smooth closed surface of genus 3, uneven triangles"),
    ("bumpy-sphere", "a sphere with smooth bumps"),
    ("sphere", "a sphere of even triangles"),
    ("box", "the unit box, 12 triangles"),
    ("thin-plate", "a closed plate of 1 x 1 x 0.01"),
    ("tetrahedron", "a regular tetrahedron"),
    ("open-hemisphere", "half a sphere with one open boundary"),
    ("two-components", "a sphere and a torus apart from each other"),
];

const SAMPLES: &[Sample] = &[
    Sample { name: "torus", make: uneven_torus },
    Sample { name: "genus3", make: three_rings },
    Sample { name: "bumpy-sphere", make: bumpy_sphere },
    Sample { name: "sphere", make: || shapes::sphere(4) },
    Sample { name: "box", make: || shapes::grid_box(DVec3::ONE, [1, 1, 1]) },
    Sample { name: "thin-plate", make: || shapes::grid_box(DVec3::new(1.0, 1.0, 0.01), [12, 12, 1]) },
    Sample { name: "tetrahedron", make: shapes::tetrahedron },
    Sample { name: "open-hemisphere", make: || shapes::hemisphere(16, 64) },
    Sample { name: "two-components", make: sphere_and_torus },
];

/// The names that [`sample`] takes, each with a description of one line.
pub fn names() -> &'static [(&'static str, &'static str)] {
    NAMES
}

/// The model called `name`; all are about 1 to 4 units large and near the origin.
///
/// # Errors
///
/// [`Error::Usage`] listing the names if there is no such model.
pub fn sample(name: &str) -> Result<TriMesh> {
    if let Some(sample) = SAMPLES.iter().find(|sample| sample.name == name) {
        return Ok((sample.make)());
    }
    let names: Vec<&str> = NAMES.iter().map(|(name, _)| *name).collect();
    Err(Error::usage(
        format!("there is no built-in model '{name}'"),
        format!("choose one of {}", names.join(", ")),
    ))
}

fn uneven_torus() -> TriMesh {
    shapes::torus(shapes::Torus { around: 72, tube: 24, warp: 0.55, jitter: 0.25 })
}

fn bumpy_sphere() -> TriMesh {
    let mut mesh = shapes::sphere(4);
    for vertex in &mut mesh.vertices {
        let p = *vertex;
        let bumps = (4.0 * p.x + 0.5).sin() * (5.0 * p.y).cos() + 0.6 * (6.0 * p.z + 2.0 * p.x).sin();
        *vertex = p * (1.0 + 0.12 * bumps);
    }
    mesh
}

fn sphere_and_torus() -> TriMesh {
    let mut mesh = shapes::torus(shapes::Torus { around: 48, tube: 16, warp: 0.0, jitter: 0.0 });
    let start = mesh.vertices.len() as u32;
    let sphere = shapes::sphere(3);
    mesh.vertices.extend(sphere.vertices.iter().map(|vertex| 0.8 * *vertex + DVec3::new(2.5, 0.0, 0.3)));
    mesh.triangles.extend(sphere.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + start)));
    mesh
}

fn three_rings() -> TriMesh {
    // Neighbouring rings overlap in one place each; the chain has three holes.
    const RINGS: [(f64, f64); 3] = [(-1.28, 0.5), (0.0, -0.3), (1.28, 0.4)];
    // Width of the blend where rings meet.
    const BLEND: f64 = 0.08;
    let field = |p: DVec3| {
        let distance = |(x, tilt): (f64, f64)| {
            let q = glam::DQuat::from_rotation_x(tilt) * (p - DVec3::new(x, 0.0, 0.0));
            let from_circle = q.truncate().length() - 0.55;
            from_circle.hypot(q.z) - 0.21
        };
        -BLEND * RINGS.iter().map(|ring| (-distance(*ring) / BLEND).exp()).sum::<f64>().ln()
    };
    tetrahedra::level_set(field, DVec3::new(-2.25, -1.0, -0.85), DVec3::new(2.25, 1.0, 0.85), 0.105)
}
