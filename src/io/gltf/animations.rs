//! Reads animations of nodes.

use std::collections::HashMap;

use serde::Deserialize;

use super::accessors::Buffers;
use super::skins::said;
use crate::grammar::counted;
use crate::io::checks::outgrows;
use crate::mesh::NONE;
use crate::mesh::attributes::{Animation, Channel, Track};

#[derive(Deserialize)]
pub(crate) struct AnimationEntry {
    name: Option<String>,
    channels: Vec<ChannelEntry>,
    samplers: Vec<SamplerEntry>,
}

#[derive(Deserialize)]
struct ChannelEntry {
    sampler: usize,
    target: Target,
}

#[derive(Deserialize)]
struct Target {
    node: Option<usize>,
    path: Path,
}

#[derive(Deserialize, Clone, Copy)]
#[serde(rename_all = "lowercase")]
enum Path {
    Translation,
    Rotation,
    Scale,
    /// Weights of morph targets, and what extensions move.
    #[serde(other)]
    Other,
}

#[derive(Deserialize)]
struct SamplerEntry {
    input: usize,
    output: usize,
    #[serde(default)]
    interpolation: Interpolation,
}

#[derive(Deserialize, Clone, Copy, Default)]
#[serde(rename_all = "UPPERCASE")]
enum Interpolation {
    #[default]
    Linear,
    Step,
    CubicSpline,
}

/// The animations read so far.
pub(crate) struct AnimationReader<'a> {
    buffers: &'a Buffers<'a>,
    /// Of all that was read.
    bytes: usize,
    animations: Vec<Animation>,
    tracks: Vec<Track>,
    /// Tracks by accessor and components.
    known: HashMap<(usize, usize), usize>,
}

impl<'a> AnimationReader<'a> {
    /// `bytes` were read before.
    pub fn new(buffers: &'a Buffers<'a>, bytes: usize) -> Self {
        Self { buffers, bytes, animations: Vec::new(), tracks: Vec::new(), known: HashMap::new() }
    }

    /// Adds an animation, if it moves a node with a bone; the error says what is wrong.
    pub fn read(&mut self, entry: AnimationEntry, bone_of: &[u32]) -> Result<(), String> {
        let mut channels = Vec::new();
        for ChannelEntry { sampler, target } in entry.channels {
            let bone = target.node.and_then(|node| bone_of.get(node).copied()).filter(|bone| *bone != NONE);
            let (path, components) = match target.path {
                Path::Translation => ("translation", 3),
                Path::Rotation => ("rotation", 4),
                Path::Scale => ("scale", 3),
                Path::Other => continue,
            };
            let Some(bone) = bone else { continue };
            let Some(sampler) = entry.samplers.get(sampler) else {
                return Err(format!("there is no sampler {sampler}"));
            };
            let (interpolation, values_each) = match sampler.interpolation {
                Interpolation::Linear => ("LINEAR", 1),
                Interpolation::Step => ("STEP", 1),
                // Each value lies between two tangents.
                Interpolation::CubicSpline => ("CUBICSPLINE", 3),
            };
            let (times, time_count) = self.track(sampler.input, 1)?;
            let (values, value_count) = self.track(sampler.output, components)?;
            if time_count == 0 || value_count != values_each * time_count {
                let values = counted(value_count, ["value", "values"]);
                return Err(format!("a sampler has {values} for {}", counted(time_count, ["time", "times"])));
            }
            channels.push(Channel { bone, path, interpolation, times, values });
        }
        if !channels.is_empty() {
            self.animations.push(Animation { name: entry.name, channels });
        }
        Ok(())
    }

    /// The index of the track with an accessor's numbers, and how many elements it has.
    fn track(&mut self, accessor: usize, components: usize) -> Result<(usize, usize), String> {
        let count = |track: &Track| track.values.len() / components;
        if let Some(known) = self.known.get(&(accessor, components)) {
            return Ok((*known, self.tracks.get(*known).map_or(0, count)));
        }
        let kind = if components == 1 { "SCALAR".to_owned() } else { format!("VEC{components}") };
        let elements = self.buffers.elements(accessor, &kind).map_err(said)?;
        // The numbers themselves fit the file, but accessors may share them.
        self.bytes = self.bytes.saturating_add(4 * components * elements.count);
        if outgrows(self.bytes as u64, self.buffers.read_bytes()) {
            return Err("animations repeat their numbers too often".to_owned());
        }
        let numbers = |index| (0..components).map(move |at| (index, at));
        let numbers = (0..elements.count).flat_map(numbers);
        let values: Vec<f32> = numbers.map(|(index, at)| elements.number(index, at) as f32).collect();
        if !values.iter().all(|value| value.is_finite()) {
            return Err(format!("accessor {accessor}: a number is not finite"));
        }
        self.tracks.push(Track { components, values });
        self.known.insert((accessor, components), self.tracks.len() - 1);
        Ok((self.tracks.len() - 1, elements.count))
    }

    /// The animations and the tracks of their channels.
    pub fn finish(self) -> (Vec<Animation>, Vec<Track>) {
        (self.animations, self.tracks)
    }
}
