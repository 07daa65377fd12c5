//! Sites on a surface with curves, and all that kernels read of them.

use super::{device, on_sphere, rng, rounded, slots};
use crate::reference::face::{Face, face};
use crate::reference::knn::nearest;
use crate::reference::octahedral::{pack, unpack};
use crate::reference::pins::Mark;
use crate::support::polygons::frame;
use glam::{DVec3, Vec2, Vec4};
use rand::RngExt;
use rtfmesh::gpu::Buffer;
use rtfmesh::gpu::Recorder;
use rtfmesh::stages::blocks::{Block, Blocked};
use rtfmesh::stages::face::planar::PlanarInputs;
use rtfmesh::stages::neighbours::lists::{ListOptions, Lists, NEAR};

/// Length of the lists of neighbours.
pub const K: usize = 24;

/// Sites on a sphere in two patches, every fifth one on a curve.
pub struct CurveScene {
    pub positions: Vec<DVec3>,
    /// As the kernels have them.
    pub unit: Vec<DVec3>,
    pub marks: Vec<Mark>,
    pub near: Vec<Vec<u32>>,
    pub sites: Buffer<Vec4>,
    pub normals: Buffer<u32>,
    pub neighbours: Blocked<u32>,
    pub away: Buffer<Vec2>,
    pub status: Buffer<u32>,
    pub lists: Lists,
}

impl CurveScene {
    pub fn new(n: usize, seed: u64) -> Self {
        Self::in_blocks(n, seed, n)
    }

    /// With lists in blocks of so many sites.
    pub fn in_blocks(n: usize, seed: u64, block: usize) -> Self {
        let (positions, mut normals) = on_sphere(n, seed);
        let positions = rounded(&positions);
        let mut rng = rng(seed);
        let marks: Vec<Mark> = (0..n)
            .map(|i| match i % 15 {
                4 => Mark::CORNER,
                9 | 14 => Mark::Pinned {
                    direction: normals[i].cross(DVec3::X + DVec3::Y).normalize(),
                    quarters: rng.random_range(1..8),
                    anywhere: i % 2 == 0,
                },
                _ => Mark::Interior(u32::from(positions[i].z > 0.0)),
            })
            .collect();
        // Some curve sites face the other way.
        (0..n).filter(|i| marks[*i].is_pinned() && i % 3 == 0).for_each(|i| normals[i] = -normals[i]);
        let packed: Vec<u32> = normals.iter().map(|n| pack(*n)).collect();
        let near = nearest(&positions, &positions, K + 1, true);
        let beyond = |i: usize, rank: usize| {
            let far = near[i].get(rank).map(|j| positions[*j as usize].distance(positions[i]));
            far.map_or(f32::INFINITY, |d| d as f32)
        };
        let away: Vec<Vec2> = (0..n).map(|i| Vec2::new(beyond(i, NEAR as usize), beyond(i, K))).collect();
        let words: Vec<Vec4> =
            positions.iter().zip(&marks).map(|(p, mark)| p.as_vec3().extend(mark.encode())).collect();
        let sites = Buffer::from_slice(device(), "test.sites", &words).unwrap();
        let blocks = Block::divide(n, block);
        let lists = Lists::new(device(), n, &ListOptions::new(K as u32)).unwrap();
        let mut recorder = Recorder::new(device()).unwrap();
        lists.record_build(&mut recorder, &sites).unwrap();
        recorder.submit().unwrap();
        Self {
            sites,
            lists,
            normals: Buffer::from_slice(device(), "test.normals", &packed).unwrap(),
            neighbours: Blocked::from_slice(device(), "test.neighbours", &blocks, &slots(&near, K)).unwrap(),
            away: Buffer::from_slice(device(), "test.away", &away).unwrap(),
            status: Buffer::from_slice(device(), "test.status", &[0; 4]).unwrap(),
            unit: packed.iter().map(|n| unpack(*n)).collect(),
            positions,
            marks,
            near,
        }
    }

    pub fn inputs(&self) -> PlanarInputs<'_> {
        let Self { sites, normals, neighbours, away, status, lists, .. } = self;
        PlanarInputs { sites, normals, neighbours, away, status, tree: lists.tree() }
    }

    pub fn faces(&self, i: usize, j: usize) -> bool {
        self.marks[j].counts_anywhere() || self.unit[j].dot(self.unit[i]) > -0.2
    }

    /// The polygon of an interior site from all sites that count.
    pub fn want(&self, site: usize) -> Face {
        let Mark::Interior(patch) = self.marks[site] else { panic!("it needs no face") };
        let counts = |j: usize| j == site || (self.marks[j].is_in(patch) && self.faces(site, j));
        let counted: Vec<usize> = (0..self.positions.len()).filter(|j| counts(*j)).collect();
        let positions: Vec<DVec3> = counted.iter().map(|j| self.positions[*j]).collect();
        let (u, v) = frame(self.unit[site]);
        face(&positions, counted.iter().position(|j| *j == site).unwrap(), u, v, 2.0)
    }
}
