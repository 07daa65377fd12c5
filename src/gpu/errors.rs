//! Failed Vulkan calls as errors with a remedy.

use crate::Error;
use ash::vk;

/// How to get a Vulkan driver. The last but one is a loader alone, for a driver of the system.
pub(crate) const INSTALL_DRIVER: &str = "install one: apt install libvulkan1 mesa-vulkan-drivers; dnf \
    install vulkan-loader mesa-vulkan-drivers; pacman -S vulkan-icd-loader vulkan-swrast; conda install -c \
    conda-forge libvulkan-loader; brew install vulkan-loader molten-vk";

/// The [`Error`] for a Vulkan call that failed; `what` says what was being done.
pub(super) fn vk_error(what: &str, result: vk::Result) -> Error {
    let (problem, remedy) = match result {
        vk::Result::ERROR_DEVICE_LOST => return Error::DeviceLost(what.to_owned()),
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
            (format!("out of memory during {what}"), "close other programs, or ask for fewer vertices")
        }
        other => (format!("{what} failed: {other}"), "update the Vulkan driver, or choose another `device`"),
    };
    Error::device(problem, remedy).caused_by(result)
}
