//! Faces that `face/cell` makes on the device, for its own test and for that of the centroids.

use super::{assert_valid, device, slots, upload};
use crate::reference::knn::nearest;
use glam::{DVec2, DVec3, Vec2, Vec4};
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::face::cell::{CellFaces, CellOptions};
use rtfmesh::stages::neighbours::knn::TileBounds;

pub struct DeviceFaces {
    pub sites: Buffer<Vec4>,
    pub normals: Buffer<Vec4>,
    pub faces: CellFaces,
    /// As the kernel left them, in f64.
    pub corners: Vec<Vec<DVec2>>,
    pub fans: Vec<Vec<u32>>,
    pub flags: Vec<u32>,
}

pub fn device_faces(sites: &[DVec3], normals: &[DVec3], options: &CellOptions) -> DeviceFaces {
    let uploaded: Vec<Vec4> = sites.iter().map(|p| p.as_vec3().extend(0.0)).collect();
    device_faces_of(&uploaded, sites, normals, options)
}

/// Of sites that are uploaded with fourth components.
pub fn device_faces_of(
    uploaded: &[Vec4],
    sites: &[DVec3],
    normals: &[DVec3],
    options: &CellOptions,
) -> DeviceFaces {
    let device = device();
    let (n, k) = (sites.len(), options.k as usize);
    let neighbours = slots(&nearest(sites, sites, k, true), k);
    let normals = upload("test.normals", normals);
    let sites = Buffer::from_slice(device, "test.sites", uploaded).unwrap();
    let neighbours = Buffer::from_slice(device, "test.neighbours", &neighbours).unwrap();
    let flags = Buffer::from_slice(device, "test.flags", &vec![0_u32; n]).unwrap();
    let bounds = TileBounds::new(device, "test.bounds", n).unwrap();
    let faces = CellFaces::new(device, n, options).unwrap();
    let mut recorder = Recorder::new(device).unwrap();
    bounds.record(&mut recorder, &sites).unwrap();
    faces.record(&mut recorder, &sites, &normals, &neighbours, &bounds, &flags).unwrap();
    recorder.submit().unwrap();
    assert_valid(device);
    let counts = faces.corner_count.to_vec(device).unwrap();
    let corners: Vec<Vec2> = faces.corners.to_vec(device).unwrap();
    let fan = faces.fan.to_vec(device).unwrap();
    let slots = |i: usize| (0..counts[i] as usize).map(move |s| s * n + i);
    DeviceFaces {
        sites,
        normals,
        corners: (0..n).map(|i| slots(i).map(|s| corners[s].as_dvec2()).collect()).collect(),
        fans: (0..n).map(|i| slots(i).map(|s| fan[s]).collect()).collect(),
        flags: flags.to_vec(device).unwrap()[..n].to_vec(),
        faces,
    }
}
