//! Volumes: their files, surfaces in them, and what is refused.

mod boxes;
mod files;
mod iso;
mod labels;
mod metaimage;
mod several;
mod vtk;

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

/// The bytes of a volume as a NRRD file, with values as 32-bit numbers.
pub fn nrrd(volume: &Volume) -> Vec<u8> {
    let [x, y, z] = volume.size;
    let header = format!("NRRD0004\ntype: float\ndimension: 3\nsizes: {x} {y} {z}\nencoding: raw\n\n");
    [header.as_bytes(), bytemuck::cast_slice(&volume.values)].concat()
}

/// The bytes of a volume as a NIfTI file, with values as 32-bit numbers.
pub fn nifti(volume: &Volume) -> Vec<u8> {
    let mut bytes = vec![0; 352];
    let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
    let [x, y, z] = volume.size.map(|nodes| nodes as u16);
    put(0, &348_i32.to_le_bytes());
    put(40, bytemuck::cast_slice(&[3, x, y, z, 1, 1, 1, 1]));
    put(70, &16_i16.to_le_bytes());
    put(76, bytemuck::cast_slice(&[1.0_f32; 4]));
    put(108, &352_f32.to_le_bytes());
    put(344, b"n+1\0");
    bytes.extend(bytemuck::cast_slice::<f32, u8>(&volume.values));
    bytes
}
