//! Failed Vulkan calls as errors with a remedy.

use crate::Error;
use ash::vk;

/// The [`Error`] for a Vulkan call that failed; `what` says what was being done.
pub(super) fn vk_error(what: &str, result: vk::Result) -> Error {
    match result {
        vk::Result::ERROR_DEVICE_LOST => Error::DeviceLost(what.to_owned()),
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => Error::Device {
            problem: format!("out of memory during {what}"),
            remedy: "close other programs, or ask for fewer vertices".to_owned(),
        },
        other => Error::device(
            format!("{what} failed: {other}"),
            "update the Vulkan driver, or choose another `device`",
        ),
    }
}
