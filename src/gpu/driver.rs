//! Drivers opened without a Vulkan loader, by the interface through which a loader talks to them.

use super::instance::Instance;
use super::manifests::{library, manifests};
use ash::vk;
use libloading::Library;
use std::ffi::CStr;
use std::path::Path;

/// Of the interface between loader and driver. From 2 on, a driver has the functions below; from 5 on, it
/// minds the Vulkan version that we ask for. Later versions are for what a loader does with windows and the
/// order of devices.
const INTERFACE: u32 = 5;
const LEAST_INTERFACE: u32 = 2;

type Negotiate = unsafe extern "system" fn(*mut u32) -> vk::Result;

/// Instances of all drivers that this system names and that have a device; or why there is none.
pub(super) fn open_all() -> Result<Vec<Instance>, String> {
    let (mut open, mut problems, mut seen) = (Vec::new(), Vec::new(), Vec::new());
    for manifest in manifests(|name| std::env::var_os(name)) {
        let path = match library(&manifest) {
            // Two folders may name one driver.
            Ok(path) if seen.contains(&path) => continue,
            Ok(path) => path,
            Err(why) => {
                problems.push(why);
                continue;
            }
        };
        match open_driver(&path) {
            Ok(instance) => open.extend(instance),
            Err(why) => problems.push(format!("{}: {why}", path.display())),
        }
        seen.push(path);
    }
    match (open.is_empty(), problems.is_empty(), seen.is_empty()) {
        (false, ..) => Ok(open),
        (_, false, _) => Err(format!("no driver opens without it ({})", problems.join(", "))),
        (.., true) => Err("no manifest names a driver".to_owned()),
        _ => Err("no driver has a device".to_owned()),
    }
}

/// An instance of one driver; `None` if it has no device.
fn open_driver(path: &Path) -> Result<Option<Instance>, String> {
    // SAFETY: loading runs the initialisers of a library that the system names as a driver; a loader would do
    // the same.
    let library = unsafe { Library::new(path) }.map_err(|e| e.to_string())?;
    let get_instance_proc_addr = negotiate(&library)?;
    // SAFETY: by the interface, the function is the driver's vkGetInstanceProcAddr; the instance keeps the
    // library loaded.
    let entry = unsafe { ash::Entry::from_static_fn(ash::StaticFn { get_instance_proc_addr }) };
    let Some(instance) = Instance::new(entry, Some(library), false).map_err(|e| e.to_string())? else {
        return Err(format!(
            "no driver for Vulkan {}",
            super::select::version_text(super::instance::VERSION)
        ));
    };
    let handles = instance.physical_devices().map_err(|e| e.to_string())?;
    Ok((!handles.is_empty()).then_some(instance))
}

/// Agrees with a driver on the interface; its `vkGetInstanceProcAddr`.
fn negotiate(library: &Library) -> Result<vk::PFN_vkGetInstanceProcAddr, String> {
    let missing = |name: &CStr| format!("no Vulkan driver: it has no {}", name.to_string_lossy());
    let (negotiate, get) = (c"vk_icdNegotiateLoaderICDInterfaceVersion", c"vk_icdGetInstanceProcAddr");
    // SAFETY: the names belong to the interface, which gives them these types.
    let (agree, proc) = unsafe {
        let agree =
            library.get::<Negotiate>(negotiate.to_bytes_with_nul()).map_err(|_| missing(negotiate))?;
        let proc = library.get::<vk::PFN_vkGetInstanceProcAddr>(get.to_bytes_with_nul());
        (agree, *proc.map_err(|_| missing(get))?)
    };
    let mut version = INTERFACE;
    // SAFETY: the function reads and writes this one number.
    match unsafe { agree(&mut version) } {
        vk::Result::SUCCESS if version >= LEAST_INTERFACE => Ok(proc),
        vk::Result::SUCCESS => Err(format!("its interface is version {version}; update the driver")),
        other => Err(format!("it refuses interface version {INTERFACE} ({other})")),
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_driver_says_why() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("lib.so");
        std::fs::write(&file, "no library").unwrap();
        for (path, part) in [
            (&*file, "lib.so"),
            (&place.path().join("none.so"), "none.so"),
            (Path::new("libnone-of-this-name.so"), "libnone-of-this-name.so"),
            // A library, but none of a driver.
            (Path::new("libm.so.6"), "vk_icdNegotiateLoaderICDInterfaceVersion"),
        ] {
            let why = open_driver(path).err().unwrap();
            assert!(why.contains(part) && !why.contains('\n'), "{why}");
        }
    }
}
