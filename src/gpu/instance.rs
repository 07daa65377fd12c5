//! The Vulkan instance and, on request, the validation layers with all their messages.

use super::driver;
use super::errors::{INSTALL_DRIVER, vk_error};
use super::forks;
use crate::{Error, Result};
use ash::{ext, khr, vk};
use libloading::Library;
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

/// The least version of Vulkan that will do.
pub(super) const VERSION: u32 = vk::API_VERSION_1_2;
const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Validation messages of one instance, oldest first.
pub(super) type Messages = Mutex<Vec<String>>;

/// The loaded Vulkan library, a loader or a driver, and one instance of it.
pub(super) struct Instance {
    pub raw: ash::Instance,
    pub messages: Arc<Messages>,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    debug_utils: bool,
    _entry: ash::Entry,
    /// Where there is no loader; goes last, since everything above is the driver's.
    _driver: Option<Library>,
}

/// The instances through which all devices can be reached: the loader's or, where there is no loader or it
/// finds no device, one of each driver that opens without it. Only a loader has validation.
///
/// Refused in a process that was forked from one that has used a GPU; see [`forks`].
pub(super) fn open_all(validation: bool) -> Result<Vec<Instance>> {
    forks::require_openable()?;
    // SAFETY: loading runs the initialisers of the system's Vulkan loader, which every Vulkan program trusts.
    let entry = match unsafe { ash::Entry::load() } {
        Ok(entry) => entry,
        Err(e) if validation => {
            let problem = format!("there is no Vulkan loader, which validation needs ({e})");
            let remedy = "install both (Debian: apt install libvulkan1 vulkan-validationlayers)";
            return Err(Error::device(problem, remedy).caused_by(e));
        }
        Err(e) => {
            return driver::open_all().map_err(|why| {
                Error::device(format!("there is no Vulkan loader ({e}), and {why}"), INSTALL_DRIVER)
                    .caused_by(e)
            });
        }
    };
    #[cfg(test)]
    let entry = super::faults::hooked(entry);
    let none = vk::Result::ERROR_INCOMPATIBLE_DRIVER;
    match Instance::new(entry, None, validation)? {
        Some(instance) if validation || !instance.physical_devices()?.is_empty() => Ok(vec![instance]),
        Some(instance) => Ok(driver::open_all().unwrap_or_else(|_| vec![instance])),
        None if validation => Err(Error::device("there is no Vulkan driver", INSTALL_DRIVER).caused_by(none)),
        None => driver::open_all().map_err(|why| {
            Error::device(format!("there is no Vulkan driver for the loader, and {why}"), INSTALL_DRIVER)
                .caused_by(none)
        }),
    }
}

impl Instance {
    /// An instance of what `entry` leads to, the loader or the `driver` that it belongs to; `None` where no
    /// driver has our version of Vulkan. `validation` turns on core and synchronization validation and
    /// collects their messages.
    pub fn new(entry: ash::Entry, driver: Option<Library>, validation: bool) -> Result<Option<Self>> {
        // SAFETY: the entry is loaded; the call only reads.
        let known = unsafe { entry.enumerate_instance_extension_properties(None) }
            .map_err(|e| vk_error("listing the instance extensions", e))?;
        let has = |name: &CStr| known.iter().any(|p| p.extension_name_as_c_str() == Ok(name));
        let portability = has(khr::portability_enumeration::NAME);
        let debug_utils = validation;
        if validation {
            require_validation_layer(&entry)?;
        }
        let mut extensions = Vec::new();
        if portability {
            extensions.push(khr::portability_enumeration::NAME.as_ptr());
        }
        let mut layers = Vec::new();
        if validation {
            extensions.push(ext::debug_utils::NAME.as_ptr());
            extensions.push(ext::validation_features::NAME.as_ptr());
            layers.push(VALIDATION_LAYER.as_ptr());
        }
        let app = vk::ApplicationInfo::default().application_name(c"rtfmesh").api_version(VERSION);
        let checks = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&checks);
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&app)
            .enabled_extension_names(&extensions)
            .enabled_layer_names(&layers);
        if portability {
            info = info.flags(vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR);
        }
        if validation {
            info = info.push_next(&mut features);
        }
        // SAFETY: all pointers in `info` outlive the call.
        let raw = match unsafe { entry.create_instance(&info, None) } {
            Err(vk::Result::ERROR_INCOMPATIBLE_DRIVER) => return Ok(None),
            other => other.map_err(|e| vk_error("creating the instance", e))?,
        };
        let messages = Arc::default();
        let mut this = Self { raw, messages, messenger: None, debug_utils, _entry: entry, _driver: driver };
        if validation {
            this.collect_messages()?;
        }
        Ok(Some(this))
    }

    /// Its devices, none where a loader cannot load any driver.
    pub fn physical_devices(&self) -> Result<Vec<vk::PhysicalDevice>> {
        // SAFETY: the instance is alive; the call only reads.
        match unsafe { self.raw.enumerate_physical_devices() } {
            Err(vk::Result::ERROR_INITIALIZATION_FAILED) => Ok(Vec::new()),
            other => other.map_err(|e| vk_error("listing the devices", e)),
        }
    }

    /// Whether objects can be named for validation messages.
    pub fn names_objects(&self) -> bool {
        self.debug_utils
    }

    fn collect_messages(&mut self) -> Result<()> {
        let debug = ext::debug_utils::Instance::new(&self._entry, &self.raw);
        let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::ERROR | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
            )
            .message_type(
                vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                    | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
            )
            .pfn_user_callback(Some(on_message))
            .user_data(Arc::as_ptr(&self.messages).cast_mut().cast());
        // SAFETY: the messages are shared and dropped after the messenger, see Drop.
        let messenger = unsafe { debug.create_debug_utils_messenger(&info, None) }
            .map_err(|e| vk_error("creating the validation messenger", e))?;
        self.messenger = Some((debug, messenger));
        Ok(())
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: nothing made from the instance lives on: Device holds it in an Arc and drops its own
        // objects first.
        unsafe {
            if let Some((debug, messenger)) = &self.messenger {
                debug.destroy_debug_utils_messenger(*messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

fn require_validation_layer(entry: &ash::Entry) -> Result<()> {
    // SAFETY: the entry is loaded; the call only reads.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }
        .map_err(|e| vk_error("listing the instance layers", e))?;
    if layers.iter().any(|l| l.layer_name_as_c_str() == Ok(VALIDATION_LAYER)) {
        return Ok(());
    }
    Err(Error::device(
        "validation needs the Vulkan validation layers, which are not installed",
        "install them (Debian: apt install vulkan-validationlayers)",
    ))
}

unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    messages: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: Vulkan passes valid data with a valid message, and the pointer that `collect_messages`
    // registered.
    unsafe {
        if let (Some(data), Some(messages)) = (data.as_ref(), messages.cast::<Messages>().as_ref()) {
            let text = data.message_as_c_str().map_or_else(String::new, |m| m.to_string_lossy().into_owned());
            if let Ok(mut list) = messages.lock() {
                list.push(text);
            }
        }
    }
    vk::FALSE
}
