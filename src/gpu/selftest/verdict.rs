//! What the self-test found, kept on disk next to the compiled kernels: it runs once for each driver.

use super::{KERNELS, SelfTest};
use crate::gpu::cache;
use crate::gpu::select::DeviceInfo;
use serde::{Deserialize, Serialize};
use std::hash::{DefaultHasher, Hash, Hasher};

/// The content of a file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Kept {
    /// See [`identity`].
    identity: String,
    self_test: SelfTest,
}

/// What a verdict is about: a device with its driver, as `driver` tells it from other versions, and the
/// kernels of the self-test.
pub(in crate::gpu) fn identity(info: &DeviceInfo, driver: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    (&info.uuid, &info.name, &info.driver, info.limits.subgroup_size).hash(&mut hasher);
    driver.hash(&mut hasher);
    for kernel in KERNELS {
        (kernel.spirv, kernel.texel_spirv).hash(&mut hasher);
    }
    hasher.finish()
}

fn suffix(info: &DeviceInfo) -> String {
    format!("-{}.selftest", info.uuid)
}

/// What was found before; [`SelfTest::Untested`] if nothing was, the driver is another one, or the file is
/// damaged.
pub(in crate::gpu) fn load(info: &DeviceInfo, identity: u64) -> SelfTest {
    let kept = serde_json::from_slice::<Kept>(&cache::load(info, &suffix(info)));
    let of_this = kept.ok().filter(|kept| kept.identity == format!("{identity:016x}"));
    of_this.map_or(SelfTest::Untested, |kept| kept.self_test)
}

/// Keeps it for later.
pub(in crate::gpu) fn store(info: &DeviceInfo, identity: u64, self_test: &SelfTest) {
    let kept = Kept { identity: format!("{identity:016x}"), self_test: self_test.clone() };
    if let Ok(text) = serde_json::to_vec(&kept) {
        cache::store(info, &suffix(info), &text);
    }
}
