//! The pipeline cache on disk: compiled kernels of earlier runs, kept per user, device and driver.

use super::select::DeviceInfo;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;

/// The cache file of this device; `None` if the system has no cache folder for the user. `RTFMESH_CACHE_DIR`
/// overrides the folder.
fn cache_path(info: &DeviceInfo) -> Option<PathBuf> {
    let folder = std::env::var_os("RTFMESH_CACHE_DIR")
        .map(PathBuf::from)
        .or_else(|| dirs::cache_dir().map(|d| d.join("rtfmesh")))?;
    let sanitized =
        |s: &str| s.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect::<String>();
    Some(folder.join(format!("{}-{}.pipelines", sanitized(&info.name), sanitized(&info.driver))))
}

/// The cache of earlier runs, or nothing. The driver itself rejects data of another device or version.
pub(super) fn load(info: &DeviceInfo) -> Vec<u8> {
    cache_path(info).and_then(|p| std::fs::read(p).ok()).unwrap_or_default()
}

/// What tells one content of the cache from another.
pub(super) fn digest(data: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    data.hash(&mut hasher);
    hasher.finish()
}

/// Stores `data` for later runs, unless it is what was loaded. Without it they only take longer, so a failure
/// to write is not an error.
pub(super) fn store(info: &DeviceInfo, data: &[u8], loaded: u64) {
    if digest(data) == loaded {
        return;
    }
    let Some(path) = cache_path(info) else { return };
    let Some(folder) = path.parent() else { return };
    let write = || -> std::io::Result<()> {
        std::fs::create_dir_all(folder)?;
        let mut file = tempfile::NamedTempFile::new_in(folder)?;
        std::io::Write::write_all(&mut file, data)?;
        file.persist(&path)?;
        Ok(())
    };
    let _ = write();
}
