//! The kernels of the self-test with their buffers: each is recorded, and then compared with the host.

use super::expected::{self, DIGITS, Lane, OPERATIONS, STORED, TOLERANCE};
use super::inputs::{COUNT, Inputs, WORDS};
use super::{Check, Tally};
use crate::Result;
use crate::gpu::kernels::selftest::{arithmetic, atomics, indirect, loops, shared, subgroups};
use crate::gpu::{Buffer, Device, Kernel, Pipeline, Recorder, Submitted, Threads};
use glam::{UVec4, Vec4};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

/// What buffers have before a kernel writes; no kernel writes it everywhere.
const UNWRITTEN: u32 = 0x5eed_1e55;
/// Elements for which `selftest/arithmetic` has places, for each operation.
const PADDED: usize = 256;
/// Values of push constants and constants of pipelines.
const FACTOR: f32 = 1.5;
const SHIFT: u32 = 5;
const MOST_ROUNDS: u32 = 60;
const PICK: u32 = 7;
const SEED: u32 = 0x0bad_cafe;
/// Workgroups of `selftest/shared`.
const SHARING: u32 = 4;
/// Of `selftest/indirect` if the device decides as it should, and the invocations for which there is a place.
const COLUMNS: u32 = 3;
const ROWS: u32 = 2;
const MARKS: usize = 512;
const NUMBER: u32 = 9;

/// Pipelines and buffers.
pub(super) struct Parts<'a> {
    inputs: &'a Inputs,
    arithmetic: Pipeline<arithmetic::Shader>,
    loops: Pipeline<loops::Shader>,
    subgroups: Pipeline<subgroups::Shader>,
    shared: Pipeline<shared::Shader>,
    atomics: Pipeline<atomics::Shader>,
    indirect: Pipeline<indirect::Shader>,
    numbers: Buffer<Vec4>,
    words: Buffer<UVec4>,
    counters: Buffer<u32>,
    device: &'a Device,
}

/// Compiles a kernel of the self-test.
fn pipeline<K: Kernel>(device: &Device) -> Result<Pipeline<K>> {
    Pipeline::new(device, K::Constants::default())
}

impl<'a> Parts<'a> {
    /// Compiles the kernels in parallel.
    pub fn new(device: &'a Device, inputs: &'a Inputs) -> Result<Self> {
        let constants = arithmetic::Constants { shift: SHIFT, ..Default::default() };
        let compile: [&(dyn Fn() -> Result<()> + Sync); 6] = [
            &|| Pipeline::<arithmetic::Shader>::new(device, constants).map(drop),
            &|| pipeline::<indirect::Shader>(device).map(drop),
            &|| pipeline::<shared::Shader>(device).map(drop),
            &|| pipeline::<loops::Shader>(device).map(drop),
            &|| pipeline::<atomics::Shader>(device).map(drop),
            &|| pipeline::<subgroups::Shader>(device).map(drop),
        ];
        compile.par_iter().try_for_each(|part| part())?;
        Ok(Self {
            inputs,
            arithmetic: Pipeline::new(device, constants)?,
            loops: pipeline(device)?,
            subgroups: pipeline(device)?,
            shared: pipeline(device)?,
            atomics: pipeline(device)?,
            indirect: pipeline(device)?,
            numbers: Buffer::new(device, "selftest.numbers", COUNT)?,
            words: Buffer::new(device, "selftest.words", WORDS)?,
            counters: Buffer::new(device, "selftest.counters", 4)?,
            device,
        })
    }

    pub fn record_inputs(&self, recorder: &mut Recorder) -> Result<()> {
        recorder.upload(&self.numbers, &self.inputs.numbers)?;
        recorder.upload(&self.words, &self.inputs.words)?;
        recorder.upload(&self.counters, &expected::counted(&[]))
    }

    /// A buffer for results.
    fn output<T: bytemuck::Pod>(&self, recorder: &mut Recorder, name: &str, len: usize) -> Result<Buffer<T>> {
        let buffer = Buffer::new(self.device, name, len)?;
        recorder.fill(&buffer, UNWRITTEN)?;
        Ok(buffer)
    }

    pub fn arithmetic(&self, recorder: &mut Recorder) -> Result<Check<'a>> {
        let reals = self.output::<f32>(recorder, "selftest.reals", OPERATIONS * PADDED)?;
        let integers = self.output::<u32>(recorder, "selftest.integers", OPERATIONS * PADDED)?;
        let push = arithmetic::Push { count: COUNT as u32, factor: FACTOR };
        let (numbers, words) = (&self.numbers, &self.words);
        let bindings = arithmetic::Bindings { numbers, words, reals: &reals, integers: &integers };
        recorder.dispatch(&self.arithmetic, Threads(OPERATIONS * PADDED), &push, &bindings)?;
        let (reals, integers) = (recorder.download(&reals)?, recorder.download(&integers)?);
        let inputs = self.inputs;
        let check = move |done: &Submitted| {
            let (reals, integers): (Vec<f32>, Vec<u32>) = (done.read(&reals)?, done.read(&integers)?);
            let mut right = Vec::new();
            for (i, (number, word)) in inputs.numbers.iter().zip(&inputs.words).enumerate() {
                let places = (i..).step_by(PADDED);
                let wanted = expected::reals(*number, FACTOR).into_iter();
                let wanted = wanted.zip(expected::integers(*number, *word, SHIFT));
                for (place, (real, integer)) in places.zip(wanted) {
                    right.push((f64::from(reals[place]) - real).abs() <= TOLERANCE);
                    right.push(integers[place] == integer);
                }
            }
            Ok(Tally::of(right))
        };
        Ok((arithmetic::Shader::INFO.name, Box::new(check)))
    }

    pub fn loops(&self, recorder: &mut Recorder) -> Result<Check<'a>> {
        let rounds = self.output::<u32>(recorder, "selftest.rounds", COUNT)?;
        let sorted = self.output::<u32>(recorder, "selftest.sorted", COUNT)?;
        let push = loops::Push { count: COUNT as u32, most_rounds: MOST_ROUNDS, digit_count: DIGITS };
        let bindings = loops::Bindings { words: &self.words, rounds: &rounds, sorted: &sorted };
        recorder.dispatch(&self.loops, Threads(COUNT), &push, &bindings)?;
        let (rounds, sorted) = (recorder.download(&rounds)?, recorder.download(&sorted)?);
        let inputs = self.inputs;
        let check = move |done: &Submitted| {
            let (rounds, sorted): (Vec<u32>, Vec<u32>) = (done.read(&rounds)?, done.read(&sorted)?);
            let found = rounds.iter().zip(&sorted).zip(&inputs.words);
            Ok(Tally::of(found.flat_map(|((rounds, sorted), word)| {
                let wanted = expected::rounds(word.z, MOST_ROUNDS);
                [*rounds == wanted, *sorted == expected::sorted_digits(word.z)]
            })))
        };
        Ok((loops::Shader::INFO.name, Box::new(check)))
    }

    pub fn subgroups(&self, recorder: &mut Recorder) -> Result<Check<'a>> {
        let lanes = self.output::<u32>(recorder, "selftest.lanes", WORDS)?;
        let ballots = self.output::<u32>(recorder, "selftest.ballots", WORDS)?;
        let later = self.output::<u32>(recorder, "selftest.later", WORDS)?;
        let rounds = self.output::<u32>(recorder, "selftest.subgroup_rounds", WORDS)?;
        let push = subgroups::Push { count: WORDS as u32, pick: PICK };
        let bindings = subgroups::Bindings {
            words: &self.words,
            lanes: &lanes,
            ballots: &ballots,
            later: &later,
            rounds: &rounds,
        };
        recorder.dispatch(&self.subgroups, Threads(WORDS), &push, &bindings)?;
        let copies = [
            recorder.download(&lanes)?,
            recorder.download(&ballots)?,
            recorder.download(&later)?,
            recorder.download(&rounds)?,
        ];
        let inputs = self.inputs;
        let check = move |done: &Submitted| {
            let [lanes, ballots, later, rounds] = copies.each_ref().map(|copy| done.read(copy));
            let (lanes, ballots, later, rounds) = (lanes?, ballots?, later?, rounds?);
            let lane = |i: usize| Lane {
                lanes: u32::to_le_bytes(lanes[i]),
                ballots: [ballots[i], later[i]],
                rounds: rounds[i],
            };
            let found: Vec<Lane> = (0..WORDS).map(lane).collect();
            Ok(Tally::of(expected::lanes_are_right(&found, &inputs.words, PICK)))
        };
        Ok((subgroups::Shader::INFO.name, Box::new(check)))
    }

    pub fn shared(&self, recorder: &mut Recorder) -> Result<Check<'a>> {
        let workgroup = self.shared.workgroup();
        let count = SHARING * workgroup;
        let digests = self.output::<u32>(recorder, "selftest.digests", count as usize)?;
        let (push, bindings) = (
            shared::Push { count, seed: SEED, each: STORED / workgroup },
            shared::Bindings { digests: &digests },
        );
        recorder.dispatch(&self.shared, Threads(count as usize), &push, &bindings)?;
        let digests = recorder.download(&digests)?;
        let check = move |done: &Submitted| {
            let wanted = |invocation| expected::digest(invocation, workgroup, SEED);
            let digests: Vec<u32> = done.read(&digests)?;
            Ok(Tally::of((0..).zip(digests).map(|(i, digest)| digest == wanted(i))))
        };
        Ok((shared::Shader::INFO.name, Box::new(check)))
    }

    pub fn atomics(&self, recorder: &mut Recorder) -> Result<Check<'a>> {
        let workgroup = self.atomics.workgroup() as usize;
        let places = self.output::<u32>(recorder, "selftest.places", COUNT)?;
        let groups = self.output::<u32>(recorder, "selftest.groups", 4 * COUNT.div_ceil(workgroup))?;
        let (words, counters) = (&self.words, &self.counters);
        let bindings = atomics::Bindings { words, counters, places: &places, groups: &groups };
        let push = atomics::Push { count: COUNT as u32 };
        recorder.dispatch(&self.atomics, Threads(COUNT), &push, &bindings)?;
        let (places, groups) = (recorder.download(&places)?, recorder.download(&groups)?);
        let counters = recorder.download(counters)?;
        let words = &self.inputs.words[..COUNT];
        let check = move |done: &Submitted| {
            let mut found: Vec<u32> = done.read(&counters)?;
            found.extend(done.read(&groups)?);
            let wanted = expected::counted(words).into_iter();
            let wanted = wanted.chain(words.chunks(workgroup).flat_map(expected::counted));
            // In any order.
            let mut places: Vec<u32> = done.read(&places)?;
            places.sort_unstable();
            let of_places = (0..).zip(places).map(|(i, place)| place == i);
            Ok(Tally::of(found.into_iter().zip(wanted).map(|(a, b)| a == b).chain(of_places)))
        };
        Ok((atomics::Shader::INFO.name, Box::new(check)))
    }

    pub fn indirect(&self, recorder: &mut Recorder) -> Result<Check<'a>> {
        let marks = self.output::<u32>(recorder, "selftest.marks", MARKS)?;
        let [dispatches, others] =
            ["selftest.dispatches", "selftest.other_dispatches"].map(|name| self.output(recorder, name, 2));
        let (dispatches, others): (Buffer<UVec4>, Buffer<UVec4>) = (dispatches?, others?);
        // A device that does not decide must not run for ever.
        recorder.fill(&dispatches, 0)?;
        let push = |number| indirect::Push {
            number,
            mark_count: MARKS as u32,
            element_count: COUNT as u32,
            columns: COLUMNS,
            rows: ROWS,
        };
        let bindings = |groups| indirect::Bindings { counters: &self.counters, groups, marks: &marks };
        recorder.dispatch(&self.indirect, Threads(1), &push(0), &bindings(&dispatches))?;
        // The second one has no workgroups.
        for (at, number) in [(1, NUMBER), (0, NUMBER + 1)] {
            recorder.dispatch_indirect(&self.indirect, &dispatches, at, &push(number), &bindings(&others))?;
        }
        let (marks, dispatches) = (recorder.download(&marks)?, recorder.download(&dispatches)?);
        let ran = COLUMNS * ROWS * self.indirect.workgroup();
        let check = move |done: &Submitted| {
            let (marks, sizes): (Vec<u32>, Vec<UVec4>) = (done.read(&marks)?, done.read(&dispatches)?);
            let wanted = |i: u32| if i < ran { 16 * i + NUMBER } else { UNWRITTEN };
            let of_sizes = sizes.into_iter().zip([UVec4::ZERO, UVec4::new(COLUMNS, ROWS, 1, 0)]);
            let of_marks = (0..).zip(marks).map(|(i, mark)| mark == wanted(i));
            Ok(Tally::of(of_sizes.map(|(size, wanted)| size == wanted).chain(of_marks)))
        };
        Ok((indirect::Shader::INFO.name, Box::new(check)))
    }
}
