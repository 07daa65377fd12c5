//! What the kernels of the self-test should compute, from their definitions.

use glam::{UVec4, Vec4};
use std::collections::BTreeMap;

/// Results of `selftest/arithmetic` for one element: as many real numbers as integers.
pub(super) const OPERATIONS: usize = 16;
/// Digits of a word in base 16, as `selftest/loops` sorts them.
pub(super) const DIGITS: u32 = 8;
/// Words that a workgroup of `selftest/shared` stores.
pub(super) const STORED: u32 = 4096;

/// Largest difference of real results. Vulkan allows 2.5 units in the last place of a quotient, and 16-bit
/// integers that are rounded either way.
pub(super) const TOLERANCE: f64 = 1e-4;

/// The real numbers of `selftest/arithmetic`.
pub(super) fn reals(number: Vec4, factor: f32) -> [f64; OPERATIONS] {
    let [x, y, z, w] = number.to_array().map(f64::from);
    let (a, b) = (number.truncate().as_dvec3(), glam::DVec3::new(w, x, y));
    [
        x + y,
        x - z,
        y * z * f64::from(factor),
        z / x,
        x.sqrt(),
        1.0 / y.sqrt(),
        x.min(z) + 2.0 * y.max(w),
        z.floor() + 10.0 * w.ceil(),
        z.abs() + 3.0 * w.signum(),
        a.dot(b),
        a.cross(b).length(),
        z / a.length(),
        0.75 * x + 0.25 * y + w.clamp(-1.0, 1.0),
        (8.0 * z).trunc() + (8.0 * x).trunc(),
        -w,
        (w / 4.0).clamp(-1.0, 1.0),
    ]
}

/// The integers of `selftest/arithmetic`.
pub(super) fn integers(number: Vec4, word: UVec4, shift: u32) -> [u32; OPERATIONS] {
    let [x, y, z, w] = number.to_array();
    let (p, q) = (word.x, word.y);
    let small = (q >> 16) | 1;
    let bits = [x < y, z < w, p < q, (p as i32) < (q as i32), z >= 0.0 && w >= 0.0];
    let comparisons = bits.iter().rev().fold(0, |all, bit| 2 * all + u32::from(*bit));
    let mut results = [comparisons; OPERATIONS];
    let first = [
        p.wrapping_add(q),
        p.wrapping_sub(q),
        p.wrapping_mul(q),
        p / small,
        p % small,
        (p >> 7) ^ (q << 3),
        ((p as i32) >> shift) as u32,
        (p & q) | !p,
        10_000 * p.count_ones() + 100 * q.trailing_zeros() + p.ilog2(),
        p.min(q) ^ (p.max(q) << 1),
    ];
    results[..first.len()].copy_from_slice(&first);
    results
}

/// The length of Collatz's sequence of a word as `selftest/loops` has it.
pub(super) fn rounds(word: u32, most: u32) -> u32 {
    let mut value = word & 63;
    let mut length = 0;
    while value > 1 && length < most {
        value = if value.is_multiple_of(2) { value / 2 } else { 3 * value + 1 };
        length += 1;
    }
    length
}

/// A word with its digits in base 16 in ascending order, the smallest one last.
pub(super) fn sorted_digits(word: u32) -> u32 {
    let mut digits: [u32; DIGITS as usize] = std::array::from_fn(|d| (word >> (4 * d)) & 15);
    digits.sort_unstable();
    digits.iter().rev().fold(0, |all, digit| 16 * all + digit)
}

/// A lane of a subgroup, as `selftest/subgroups` writes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Lane {
    /// Invocation of lane 0, own lane, lanes of the subgroup, invocation of the lane asked for.
    pub lanes: [u8; 4],
    /// A word of the ballot that depends on the lane, and of a later one.
    pub ballots: [u32; 2],
    pub rounds: u32,
}

/// What the lanes of a subgroup should write; `members` are its invocations in the order of the lanes.
fn subgroup(members: &[usize], words: &[UVec4], pick: u32) -> Vec<Lane> {
    let ballot = |holds: fn(u32) -> bool| {
        let mut bits = [0_u32; 4];
        for (lane, _) in members.iter().enumerate().filter(|(_, member)| holds(words[**member].w)) {
            bits[lane / 32] |= 1 << (lane % 32);
        }
        bits
    };
    let (odd, odd_sums) = (ballot(|word| word % 2 == 1), ballot(|word| sum(word) % 2 == 1));
    let (size, first) = (members.len(), members[0]);
    let picked = members[pick as usize % size];
    let lane = |place: usize| Lane {
        lanes: [first, place, size, picked].map(|number| number as u8),
        ballots: [odd[place % 4], odd_sums[place % 4]],
        rounds: members.iter().map(|member| terms(words[*member].w)).max().unwrap_or(0),
    };
    (0..size).map(lane).collect()
}

/// Largest subgroup that Vulkan has.
const LARGEST_SUBGROUP: usize = 128;

/// Whether each lane is right. Which invocations are a subgroup is for the device to choose, so the lanes
/// that name the same first invocation are compared with what they should write together.
pub(super) fn lanes_are_right(found: &[Lane], words: &[UVec4], pick: u32) -> Vec<bool> {
    let mut right = vec![false; found.len()];
    let mut groups: BTreeMap<u8, Vec<usize>> = BTreeMap::new();
    for (i, lane) in found.iter().enumerate() {
        groups.entry(lane.lanes[0]).or_default().push(i);
    }
    for mut members in groups.into_values().filter(|members| members.len() <= LARGEST_SUBGROUP) {
        members.sort_by_key(|member| found[*member].lanes[1]);
        for (member, wanted) in members.iter().zip(subgroup(&members, words, pick)) {
            right[*member] = found[*member] == wanted;
        }
    }
    right
}

/// How many terms a lane adds.
fn terms(word: u32) -> u32 {
    (word >> 4) & 7
}

/// What it gets.
fn sum(word: u32) -> u32 {
    (0..terms(word)).fold(word, |sum, k| sum.wrapping_mul(5).wrapping_add(sum >> (k + 9)))
}

/// The digest of an invocation in `selftest/shared`.
pub(super) fn digest(invocation: u32, workgroup: u32, seed: u32) -> u32 {
    let (group, lane, each) = (invocation / workgroup, invocation % workgroup, STORED / workgroup);
    let stored = |place: u32| {
        let (k, by) = (place / workgroup, place % workgroup);
        ((group * workgroup + by) ^ seed).wrapping_mul(2 * k + 3)
    };
    (0..each)
        .fold(invocation ^ seed, |digest, k| digest.wrapping_mul(31).wrapping_add(stored(lane * each + k)))
}

/// Number, least and largest word, and bits of some words, as `selftest/atomics` has them.
pub(super) fn counted(words: &[UVec4]) -> [u32; 4] {
    words.iter().map(|word| word.x).fold([0, u32::MAX, 0, 0], |[count, least, largest, bits], word| {
        [count + 1, word.min(least), word.max(largest), bits | 1 << (2 * (word & 15))]
    })
}

#[cfg(test)]
mod tests {
    use super::super::inputs::{Inputs, WORDS};
    use super::*;

    const PICK: u32 = 7;

    /// What a device with subgroups of this size writes if their lanes are these invocations.
    fn written(size: usize, lane: impl Fn(usize) -> usize, words: &[UVec4]) -> Vec<Lane> {
        let mut found = vec![Lane { lanes: [0; 4], ballots: [0; 2], rounds: 0 }; WORDS];
        for first in (0..WORDS).step_by(size) {
            let members: Vec<usize> = (0..size).map(|place| first + lane(place)).collect();
            for (member, lane) in members.iter().zip(subgroup(&members, words, PICK)) {
                found[*member] = lane;
            }
        }
        found
    }

    #[test]
    fn subgroups_of_any_size_and_order_are_accepted_and_no_wrong_lane_is() {
        let words = Inputs::new().words;
        for size in [1, 2, 4, 8, 16, 32, 64, 128] {
            // In order, and in the opposite one.
            for found in
                [written(size, |place| place, &words), written(size, |place| size - 1 - place, &words)]
            {
                assert!(lanes_are_right(&found, &words, PICK).iter().all(|right| *right), "{size}");
                let changes: [fn(&mut Lane); 7] = [
                    |lane| lane.lanes[0] ^= 1,
                    |lane| lane.lanes[1] ^= 1,
                    |lane| lane.lanes[2] ^= 1,
                    |lane| lane.lanes[3] ^= 1,
                    |lane| lane.ballots[0] ^= 1 << 31,
                    |lane| lane.ballots[1] ^= 1,
                    |lane| lane.rounds += 1,
                ];
                for (number, change) in changes.iter().enumerate() {
                    let mut found = found.clone();
                    change(&mut found[WORDS / 2 + 1]);
                    let right = lanes_are_right(&found, &words, PICK);
                    assert!(right.iter().any(|right| !right), "{size}, change {number}");
                }
            }
        }
        // What a device leaves that does nothing.
        for word in [0_u32, 0x5eed_1e55] {
            let found = vec![Lane { lanes: word.to_le_bytes(), ballots: [word; 2], rounds: word }; WORDS];
            assert!(lanes_are_right(&found, &words, PICK).iter().all(|right| !right));
        }
    }

    /// An operation that gives its first operand, 0, or what a buffer had before would else be found nowhere.
    #[test]
    fn no_result_is_trivial_for_all_elements() {
        let Inputs { numbers, words } = Inputs::new();
        let elements = || numbers.iter().zip(&words);
        for place in 0..OPERATIONS {
            let far = |a: f64, b: f32| (a - f64::from(b)).abs() > TOLERANCE;
            let is_own = |(number, _): &(&Vec4, &UVec4)| {
                let real = reals(**number, 1.5)[place];
                number.to_array().iter().all(|operand| far(real, *operand)) && far(real, 0.0)
            };
            assert!(elements().any(|element| is_own(&element)), "real {place}");
        }
        for place in 0..OPERATIONS {
            let is_own = |(number, word): &(&Vec4, &UVec4)| {
                let integer = integers(**number, **word, 5)[place];
                ![0, word.x, word.y].contains(&integer)
            };
            assert!(elements().any(|element| is_own(&element)), "integer {place}");
        }
    }
}
