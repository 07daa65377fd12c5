//! What a driver's compiler says about its code, and how much was sent to a device, for checks of both.

use super::device::{Device, lock};
use super::errors::vk_error;
use crate::Result;
use ash::vk;
use std::collections::BTreeMap;
use std::sync::atomic::Ordering;

/// A kernel as it was compiled.
#[derive(Debug, Clone, PartialEq)]
pub struct CompiledKernel {
    /// Dotted name.
    pub name: &'static str,
    /// Specialization constants by id; 0 is the workgroup.
    pub constants: Vec<(u32, u32)>,
    /// Numbers by the driver's names for them; empty if it tells none.
    pub statistics: BTreeMap<String, f64>,
}

/// What was sent to a device since it was opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SentWork {
    /// The host waits for each.
    pub submissions: u64,
    /// Memory barriers.
    pub barriers: u64,
}

impl Device {
    /// What was sent so far.
    pub fn sent_work(&self) -> SentWork {
        let [submissions, barriers] =
            [&self.shared.submissions, &self.shared.barriers].map(|count| count.load(Ordering::Relaxed));
        SentWork { submissions, barriers }
    }

    /// The kernels compiled so far, by name; see [`super::DeviceOptions::statistics`].
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the driver does not answer.
    pub fn compiled_kernels(&self) -> Result<Vec<CompiledKernel>> {
        let mut kernels = Vec::new();
        for ((name, constants), cell) in &*lock(&self.pipelines) {
            if let Some(Ok(raw)) = cell.get() {
                let statistics = self.statistics(raw.pipeline)?;
                kernels.push(CompiledKernel { name, constants: constants.clone(), statistics });
            }
        }
        kernels.sort_by(|a, b| (a.name, &a.constants).cmp(&(b.name, &b.constants)));
        Ok(kernels)
    }

    fn statistics(&self, pipeline: vk::Pipeline) -> Result<BTreeMap<String, f64>> {
        let Some(functions) = &self.shared.statistics else { return Ok(BTreeMap::new()) };
        let info = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline);
        // SAFETY: the pipeline is alive and was made to keep its statistics; a kernel is one executable.
        let list = unsafe { functions.get_pipeline_executable_statistics(&info) }
            .map_err(|e| vk_error("asking for the statistics of a kernel", e))?;
        Ok(list.iter().map(|statistic| (name_of(statistic), value_of(statistic))).collect())
    }
}

fn name_of(statistic: &vk::PipelineExecutableStatisticKHR<'_>) -> String {
    statistic.name_as_c_str().map_or_else(|_| String::new(), |name| name.to_string_lossy().into_owned())
}

fn value_of(statistic: &vk::PipelineExecutableStatisticKHR<'_>) -> f64 {
    let value = statistic.value;
    // SAFETY: the driver says which of them it has written.
    unsafe {
        match statistic.format {
            vk::PipelineExecutableStatisticFormatKHR::FLOAT64 => value.f64,
            vk::PipelineExecutableStatisticFormatKHR::BOOL32 => f64::from(value.b32),
            vk::PipelineExecutableStatisticFormatKHR::INT64 => value.i64 as f64,
            _ => value.u64 as f64,
        }
    }
}
