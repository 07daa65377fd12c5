//! Any bytes taken as a small mesh to repair. Its vertices are at few positions, so that many vertices and
//! faces coincide.

use std::collections::HashSet;

use glam::DVec3;
use rtfmesh::mesh::repair::{RepairOptions, Repaired, repair, repair_with};
use rtfmesh::mesh::topology::topology;
use rtfmesh::{Error, TriMesh};

/// Scales of the mesh: ordinary ones, and those for which squares or cubes of lengths underflow or overflow.
const SCALES: [f64; 8] = [1.0, 1e-3, 1e6, 1e-100, 1e100, 1e-160, 1e160, 1e300];
const TOLERANCES: [f64; 8] = [0.0, 1e-12, 1e-6, 1e-3, 0.02, 0.1, 0.4, 0.99];
const SHARES: [f64; 4] = [0.0, 0.01, 0.3, 0.9];
/// More would only take longer.
const MOST_TRIANGLES: usize = 64;

/// A mesh and options of bytes: scale and tolerances, how many vertices, two bytes for each, and three for
/// each triangle.
fn decoded(data: &[u8]) -> Option<(TriMesh, RepairOptions)> {
    let (&[kind, few, count], rest) = data.split_first_chunk::<3>()?;
    let scale = SCALES[usize::from(kind & 7)];
    let weld = TOLERANCES[usize::from(kind >> 3 & 7)];
    let min_component = SHARES[usize::from(kind >> 6)];
    let smooth = [0.0, 0.0, 0.01, 0.3][usize::from(few >> 6)];
    let (places, faces) = rest.split_at_checked(2 * usize::from(count))?;
    let step = f64::from(few % 5).exp2();
    let vertices = places.as_chunks::<2>().0.iter().map(|[low, high]| {
        // A grid of four steps per side, and for some vertices a small offset.
        let whole = DVec3::new(f64::from(low & 3), f64::from(low >> 2 & 3), f64::from(low >> 4 & 3));
        let off = DVec3::new(f64::from(high & 3), f64::from(high >> 2 & 3), f64::from(high >> 4 & 3));
        let share = [0.0, 1e-15, 1e-7, 0.1][usize::from(high >> 6)];
        (whole + off * share * step / 4.0) * scale
    });
    let (faces, _) = faces.as_chunks::<3>();
    // Some indices may be out of range.
    let wrapped = |v: u8| if v == 255 { 255 } else { u32::from(v) % u32::from(count.max(1)) };
    let triangles = faces.iter().take(MOST_TRIANGLES).map(|face| face.map(wrapped)).collect();
    Some((
        TriMesh { vertices: vertices.collect(), triangles },
        RepairOptions::default()
            .weld(weld)
            .min_component(min_component)
            .smooth_boundary(smooth)
            .smooth_spikes(few & 0x20 != 0)
            .outer(few & 0x10 != 0),
    ))
}

/// Repairs the mesh of the data. It must be refused with one line and a remedy, or be repaired as documented.
pub fn check(data: &[u8]) {
    let Some((mesh, options)) = decoded(data) else { return };
    match repair_with(&mesh, &options) {
        Ok(repaired) => check_repaired(&mesh, &options, &repaired),
        Err(Error::Input { problem, remedy, .. }) => {
            assert!(!problem.contains('\n') && !remedy.is_empty(), "{problem}");
        }
        Err(other) => panic!("{other:?}"),
    }
    assert_eq!(repair_with(&mesh, &options), repair_with(&mesh, &options), "the same every time");
}

fn check_repaired(input: &TriMesh, options: &RepairOptions, repaired: &Repaired) {
    let Repaired { mesh, origin, counts, .. } = repaired;
    assert!(!mesh.triangles.is_empty());
    assert!(mesh.vertices.iter().all(|vertex| vertex.is_finite()));
    let mut used = vec![false; mesh.vertices.len()];
    mesh.triangles.as_flattened().iter().for_each(|v| used[*v as usize] = true);
    assert!(used.iter().all(|used| *used), "vertices that no face uses");
    let places: HashSet<[u64; 3]> =
        mesh.vertices.iter().map(|v| v.to_array().map(|value| (value + 0.0).to_bits())).collect();
    assert_eq!(places.len(), mesh.vertices.len(), "two vertices in one place");
    assert_eq!(origin.len(), mesh.triangles.len());
    assert!(origin.iter().all(|from| (*from as usize) < input.triangles.len()));
    if counts.edges_joined == 0 {
        assert!(origin.is_sorted_by(|a, b| a < b), "{origin:?}");
    }
    let found = topology(mesh);
    assert_eq!(found.vertices, mesh.vertices.len());
    assert_eq!(found.duplicate_faces, 0);
    if counts.unorientable_components == 0 && found.nonmanifold_edges == 0 {
        assert_eq!(found.inconsistent_edges, 0);
    }
    // Tolerances must not add defects.
    let exact = repair(input).expect("less is asked for");
    let before = topology(&exact.mesh);
    assert!(found.nonmanifold_edges <= before.nonmanifold_edges, "{found:?} was {before:?}");
    let moves = options.smooth_boundary > 0.0 || options.smooth_spikes;
    if options.weld == 0.0 && options.min_component == 0.0 && !options.outer && !moves {
        assert_eq!(repaired, &exact);
    }
    // A second repair changes nothing, unless edges were joined: the number of rounds of joining is limited,
    // and they may leave small faces.
    if counts.edges_joined == 0 && !moves {
        let twice = repair(mesh).expect("a repaired mesh can be repaired");
        assert_eq!(twice.mesh, *mesh, "{:?}", twice.counts);
    }
}
