//! The pipeline cache on disk: compiled kernels of earlier runs, kept per user, device and driver.

use super::select::DeviceInfo;
use std::path::PathBuf;

/// Where the cache of this device lies; `None` where the system has no cache folder for the user.
/// `RTFMESH_CACHE_DIR` overrides the folder.
fn path(info: &DeviceInfo) -> Option<PathBuf> {
    let folder = std::env::var_os("RTFMESH_CACHE_DIR")
        .map(PathBuf::from)
        .or_else(|| dirs::cache_dir().map(|d| d.join("rtfmesh")))?;
    let clean =
        |s: &str| s.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect::<String>();
    Some(folder.join(format!("{}-{}.pipelines", clean(&info.name), clean(&info.driver))))
}

/// What an earlier run left, or nothing. The driver itself rejects data of another device or version.
pub(super) fn load(info: &DeviceInfo) -> Vec<u8> {
    path(info).and_then(|p| std::fs::read(p).ok()).unwrap_or_default()
}

/// Keeps `data` for later runs. A cache that cannot be written costs time, not results, so failures are not errors.
pub(super) fn store(info: &DeviceInfo, data: &[u8]) {
    let Some(path) = path(info) else { return };
    let Some(folder) = path.parent() else { return };
    let write = || -> std::io::Result<()> {
        std::fs::create_dir_all(folder)?;
        let mut file = tempfile::NamedTempFile::new_in(folder)?;
        std::io::Write::write_all(&mut file, data)?;
        file.persist(&path)?;
        Ok(())
    };
    // A read-only home is fine; see above.
    let _ = write();
}
