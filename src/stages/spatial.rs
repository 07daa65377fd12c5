//! Prefix sums, a stable sort, and spatial order on the device.

use crate::Result;
use crate::gpu::kernels::spatial::{
    gather_indices, gather_vectors, morton, radix_count, radix_scatter, scan_apply, scan_sum,
};
use crate::gpu::{Buffer, Device, Pipeline, Recorder, Threads};
use glam::Vec4;

/// Values that one invocation of a scan adds: `RUN` of `glsl/spatial/run.glsl`.
const RUN: usize = 32;
/// Pairs that one invocation of the sort moves: `STRIP` of `glsl/spatial/strip.glsl`.
const STRIP: usize = 32;
/// Bits of a digit, and the number of digits: `DIGITS` of `glsl/spatial/strip.glsl`.
const DIGIT_BITS: u32 = 4;
const DIGITS: usize = 1 << DIGIT_BITS;
/// Bits of the codes of `glsl/spatial/morton.comp`.
const MORTON_BITS: u32 = 30;

/// Exclusive prefix sums of `u32`, modulo 2^32.
pub struct Scan {
    sum: Pipeline<scan_sum::Shader>,
    apply: Pipeline<scan_apply::Shader>,
    /// Sums of the runs of the level below; the last one is the total.
    levels: Vec<Buffer<u32>>,
    len: usize,
}

impl Scan {
    /// For lists of `len` values.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, len: usize, workgroup: Option<u32>) -> Result<Self> {
        let mut sum = scan_sum::Constants::default();
        let mut apply = scan_apply::Constants::default();
        sum.workgroup = workgroup.unwrap_or(sum.workgroup);
        apply.workgroup = workgroup.unwrap_or(apply.workgroup);
        let mut levels = Vec::new();
        let mut runs = len;
        while runs > 1 || levels.is_empty() {
            runs = runs.div_ceil(RUN);
            levels.push(Buffer::zeros(device, "spatial.scan.sums", runs.max(1))?);
        }
        Ok(Self { sum: Pipeline::new(device, sum)?, apply: Pipeline::new(device, apply)?, levels, len })
    }

    /// The sum of all values after [`Scan::record`]: one value.
    pub fn total(&self) -> &Buffer<u32> {
        // There is always a level, see `new`.
        &self.levels[self.levels.len() - 1]
    }

    /// Records the scan of `values`, in place.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(&self, recorder: &mut Recorder, values: &Buffer<u32>) -> Result<()> {
        let mut below = (values, self.len);
        let mut steps = Vec::with_capacity(self.levels.len());
        for sums in &self.levels {
            let (values, len) = below;
            let push = scan_sum::Push { value_count: len as u32 };
            let runs = Threads(len.div_ceil(RUN));
            recorder.dispatch(&self.sum, runs, &push, &scan_sum::Bindings { values, sums })?;
            steps.push((values, len, sums));
            below = (sums, runs.0);
        }
        for (values, len, starts) in steps.into_iter().rev() {
            let push = scan_apply::Push { value_count: len as u32 };
            let bindings = scan_apply::Bindings { values, starts };
            recorder.dispatch(&self.apply, Threads(len.div_ceil(RUN)), &push, &bindings)?;
        }
        Ok(())
    }
}

/// A stable sort of pairs by the low bits of their keys.
pub struct Sort {
    count: Pipeline<radix_count::Shader>,
    scatter: Pipeline<radix_scatter::Shader>,
    scan: Scan,
    counts: Buffer<u32>,
    passes: u32,
    /// Keys before and after.
    pub keys: Buffer<u32>,
    /// Values before and after.
    pub values: Buffer<u32>,
    other_keys: Buffer<u32>,
    other_values: Buffer<u32>,
}

impl Sort {
    /// For `len` pairs by the low `bits` (0 to 32) of their keys; the bits above must be 0.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, len: usize, bits: u32, workgroup: Option<u32>) -> Result<Self> {
        let mut count = radix_count::Constants::default();
        let mut scatter = radix_scatter::Constants::default();
        count.workgroup = workgroup.unwrap_or(count.workgroup);
        scatter.workgroup = workgroup.unwrap_or(scatter.workgroup);
        let counts = DIGITS * len.div_ceil(STRIP);
        Ok(Self {
            count: Pipeline::new(device, count)?,
            scatter: Pipeline::new(device, scatter)?,
            scan: Scan::new(device, counts, workgroup)?,
            counts: Buffer::new(device, "spatial.sort.counts", counts)?,
            // An even number of passes ends in the buffers that it began with.
            passes: bits.div_ceil(DIGIT_BITS).next_multiple_of(2),
            keys: Buffer::new(device, "spatial.sort.keys", len)?,
            values: Buffer::new(device, "spatial.sort.values", len)?,
            other_keys: Buffer::new(device, "spatial.sort.other_keys", len)?,
            other_values: Buffer::new(device, "spatial.sort.other_values", len)?,
        })
    }

    /// Records the sort of [`Sort::keys`] with [`Sort::values`].
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(&self, recorder: &mut Recorder) -> Result<()> {
        let (key_count, strips) = (self.keys.len() as u32, Threads(self.keys.len().div_ceil(STRIP)));
        let mut from = (&self.keys, &self.values);
        let mut to = (&self.other_keys, &self.other_values);
        for pass in 0..self.passes {
            // A pass past the last bit only copies.
            let shift = pass * DIGIT_BITS;
            let push = radix_count::Push { key_count, shift };
            let bindings = radix_count::Bindings { keys: from.0, counts: &self.counts };
            recorder.dispatch(&self.count, strips, &push, &bindings)?;
            self.scan.record(recorder, &self.counts)?;
            let push = radix_scatter::Push { key_count, shift };
            let bindings = radix_scatter::Bindings {
                keys: from.0,
                values: from.1,
                places: &self.counts,
                sorted_keys: to.0,
                sorted_values: to.1,
            };
            recorder.dispatch(&self.scatter, strips, &push, &bindings)?;
            std::mem::swap(&mut from, &mut to);
        }
        Ok(())
    }
}

/// The Morton order of points, and arrays brought into it.
pub struct SpatialOrder {
    morton: Pipeline<morton::Shader>,
    vectors: Pipeline<gather_vectors::Shader>,
    indices: Pipeline<gather_indices::Shader>,
    sort: Sort,
}

impl SpatialOrder {
    /// For `len` points.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] or [`crate::Error::Device`].
    pub fn new(device: &Device, len: usize) -> Result<Self> {
        Ok(Self {
            morton: Pipeline::new(device, morton::Constants::default())?,
            vectors: Pipeline::new(device, gather_vectors::Constants::default())?,
            indices: Pipeline::new(device, gather_indices::Constants::default())?,
            sort: Sort::new(device, len, MORTON_BITS, None)?,
        })
    }

    /// `order()[new place] = old place`; ties keep their order.
    pub fn order(&self) -> &Buffer<u32> {
        &self.sort.values
    }

    /// The Morton codes, sorted.
    pub fn codes(&self) -> &Buffer<u32> {
        &self.sort.keys
    }

    /// Records finding the order of `points`, which are in the unit-diagonal frame.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record(&self, recorder: &mut Recorder, points: &Buffer<Vec4>) -> Result<()> {
        let push = morton::Push { point_count: points.len() as u32 };
        let bindings = morton::Bindings { points, keys: &self.sort.keys, values: &self.sort.values };
        recorder.dispatch(&self.morton, Threads(points.len()), &push, &bindings)?;
        self.sort.record(recorder)
    }

    /// Records `target[i] = source[order[i]]`.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record_vectors(
        &self,
        recorder: &mut Recorder,
        source: &Buffer<Vec4>,
        target: &Buffer<Vec4>,
    ) -> Result<()> {
        let push = gather_vectors::Push { element_count: self.order().len() as u32 };
        let bindings = gather_vectors::Bindings { order: self.order(), source, target };
        recorder.dispatch(&self.vectors, Threads(self.order().len()), &push, &bindings)
    }

    /// Records `target[i] = source[order[i]]`.
    ///
    /// # Errors
    /// As [`Recorder::dispatch`].
    pub fn record_indices(
        &self,
        recorder: &mut Recorder,
        source: &Buffer<u32>,
        target: &Buffer<u32>,
    ) -> Result<()> {
        let push = gather_indices::Push { element_count: self.order().len() as u32 };
        let bindings = gather_indices::Bindings { order: self.order(), source, target };
        recorder.dispatch(&self.indices, Threads(self.order().len()), &push, &bindings)
    }
}
