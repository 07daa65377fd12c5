//! Volumes: their files, surfaces in them, and what is refused.

mod files;
mod iso;
mod labels;

use rtfmesh::glam::{DAffine3, DVec3};
use rtfmesh::io::Volume;

/// The volume of a function of a node's place, in units of nodes.
pub fn volume_of(size: [usize; 3], value: impl Fn(DVec3) -> f64) -> Volume {
    let [nx, ny, nz] = size;
    let at = |i: usize| DVec3::new((i % nx) as f64, (i / nx % ny) as f64, (i / nx / ny) as f64);
    let values = (0..nx * ny * nz).map(|i| value(at(i)) as f32).collect();
    Volume { size, values, frame: DAffine3::IDENTITY, notes: Vec::new() }
}

/// The bytes of a volume as one of NumPy's arrays, with values as 32-bit numbers.
pub fn npy(volume: &Volume) -> Vec<u8> {
    let [x, y, z] = volume.size;
    npy_of(
        &format!("'<f4', 'fortran_order': True, 'shape': ({x}, {y}, {z})"),
        bytemuck::cast_slice(&volume.values),
    )
}

/// An array of NumPy whose header says this.
pub fn npy_of(header: &str, values: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': {header}, }}");
    let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{header:<width$}\n", width = length - 1).into_bytes());
    bytes.extend(values);
    bytes
}
