//! The Vulkan instance and, on request, the validation layers with all their messages.

use super::errors::{INSTALL_DRIVER, vk_error};
use crate::{Error, Result};
use ash::{ext, khr, vk};
use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Validation messages of one instance, oldest first.
pub(super) type Messages = Mutex<Vec<String>>;

/// The loaded Vulkan library and one instance of it.
pub(super) struct Instance {
    pub raw: ash::Instance,
    pub messages: Arc<Messages>,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    debug_utils: bool,
    _entry: ash::Entry,
}

impl Instance {
    /// Loads Vulkan; `validation` turns on core and synchronization validation and collects their messages.
    pub fn new(validation: bool) -> Result<Self> {
        // SAFETY: loading runs the initialisers of the system's Vulkan loader, which every Vulkan program
        // trusts.
        let entry = unsafe { ash::Entry::load() }.map_err(|e| {
            Error::device(format!("there is no Vulkan loader and driver ({e})"), INSTALL_DRIVER).caused_by(e)
        })?;
        #[cfg(test)]
        let entry = super::faults::hooked(entry);
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
        let app =
            vk::ApplicationInfo::default().application_name(c"rtfmesh").api_version(vk::API_VERSION_1_2);
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
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|e| match e {
            // The loader exists but found no driver.
            vk::Result::ERROR_INCOMPATIBLE_DRIVER => {
                Error::device("there is no Vulkan driver", INSTALL_DRIVER).caused_by(e)
            }
            other => vk_error("creating the instance", other),
        })?;
        let mut this = Self { raw, messages: Arc::default(), messenger: None, debug_utils, _entry: entry };
        if validation {
            this.collect_messages()?;
        }
        Ok(this)
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
        "validation was asked for, but the Vulkan validation layers are not installed",
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
