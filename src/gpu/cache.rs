//! Files on disk that save time: compiled kernels of earlier runs and what the self-test found. They are kept
//! per user, device and driver.

use super::select::DeviceInfo;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;

/// The suffix of the pipeline cache. The driver itself rejects data of another device or version.
pub(super) const PIPELINES: &str = ".pipelines";

/// A file of this device; `None` if the system has no cache folder for the user. `RTFMESH_CACHE_DIR`
/// overrides the folder.
fn cache_path(info: &DeviceInfo, suffix: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("RTFMESH_CACHE_DIR")
        .map(PathBuf::from)
        .or_else(|| dirs::cache_dir().map(|d| d.join("rtfmesh")))?;
    let sanitized =
        |s: &str| s.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect::<String>();
    Some(folder.join(format!("{}-{}{suffix}", sanitized(&info.name), sanitized(&info.driver))))
}

/// What earlier runs have stored, or nothing.
pub(super) fn load(info: &DeviceInfo, suffix: &str) -> Vec<u8> {
    cache_path(info, suffix).and_then(|p| std::fs::read(p).ok()).unwrap_or_default()
}

/// What tells one content of a file from another.
pub(super) fn digest(data: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    data.hash(&mut hasher);
    hasher.finish()
}

/// Stores `data` for later runs. Without it they only take longer, so a failure to write is not an error.
pub(super) fn store(info: &DeviceInfo, suffix: &str, data: &[u8]) {
    let Some(path) = cache_path(info, suffix) else { return };
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
