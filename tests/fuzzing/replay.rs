//! The checks of `fuzz/` on its seeds and on some thousand corrupted copies of them, always the
//! same ones.

use std::path::Path;

use rand::{Rng, RngExt};

use super::{images, reading, references, repairing};
use crate::support::rng;

/// The seeds of a target, by name.
fn seeds(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds").join(target);
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    files.iter().map(|file| std::fs::read(file).unwrap()).collect()
}

/// A copy with a few faults: bits and bytes changed, parts removed, repeated, or inserted from another seed.
fn changed(seed: &[u8], other: &[u8], random: &mut impl Rng) -> Vec<u8> {
    let mut copy = seed.to_vec();
    for _ in 0..=random.random_range(0..4) {
        let at = random.random_range(0..=copy.len());
        let end = (at + random.random_range(0..24)).min(copy.len());
        match random.random_range(0..6) {
            0 => copy.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= 1 << random.random_range(0..8)),
            1 => copy
                .iter_mut()
                .skip(at)
                .take(1)
                .for_each(|byte| *byte = b"\0\xff0- \n19"[random.random_range(0..8)]),
            2 => drop(copy.drain(at..end)),
            3 => drop(copy.splice(at..at, copy[at..end].to_vec())),
            4 => {
                let from = random.random_range(0..=other.len());
                let part = other.iter().skip(from).take(random.random_range(0..40));
                drop(copy.splice(at..end, part.copied().collect::<Vec<_>>()));
            }
            _ => copy[at..end].fill(random.random()),
        }
    }
    copy
}

/// Runs a check on the seeds of a target and on `rounds` changed copies; RTFMESH_FUZZ_ROUNDS overrides that.
fn replay(target: &str, check: impl Fn(&[u8]), rounds: usize) {
    let rounds =
        std::env::var("RTFMESH_FUZZ_ROUNDS").ok().and_then(|text| text.parse().ok()).unwrap_or(rounds);
    let seeds = seeds(target);
    assert!(seeds.len() >= 10, "{target}: the seeds are missing");
    seeds.iter().for_each(|seed| check(seed));
    let mut random = rng(1);
    for round in 0..rounds {
        let other = &seeds[random.random_range(0..seeds.len())];
        check(&changed(&seeds[round % seeds.len()], other, &mut random));
    }
}

#[test]
fn bytes_as_files() {
    replay("read", reading::check, 6000);
}

#[test]
fn bytes_as_addresses_of_files() {
    let place = references::Place::new();
    replay("references", |address| place.check(address), 4000);
}

#[test]
fn bytes_as_images() {
    replay("images", images::check, 6000);
    let expected = [Some("avif"), Some("jpeg"), Some("jpeg"), Some("ktx2"), Some("png"), None, None];
    let expected = expected.into_iter().chain([Some("webp"); 3]);
    for (seed, kind) in seeds("images").iter().zip(expected) {
        assert_eq!(images::media_type(seed), kind.map(|kind| format!("image/{kind}")));
    }
}

#[test]
fn bytes_as_meshes_to_repair() {
    replay("repair", repairing::check, 2000);
}
