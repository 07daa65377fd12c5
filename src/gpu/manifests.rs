//! The drivers that this system names: manifests where the Vulkan loader would look for them, too.

use serde::Deserialize;
use std::env::split_paths;
use std::ffi::OsString;
use std::fs::{File, metadata, read_dir};
use std::io::Read;
use std::path::{Path, PathBuf};

/// More than any manifest has; a file that is longer is something else.
const MOST_BYTES: u64 = 1 << 20;

/// The manifests of all drivers, in the loader's order; `variable` reads the environment. Those that
/// `VK_DRIVER_FILES` lists or, if that is not set, `VK_ICD_FILENAMES` are the only ones. Otherwise those of
/// `VK_ADD_DRIVER_FILES` come before those of the usual folders.
pub(super) fn manifests(variable: impl Fn(&str) -> Option<OsString>) -> Vec<PathBuf> {
    let set = |name: &str| variable(name).filter(|value| !value.is_empty());
    let listed = |value: OsString| paths(&value).iter().flat_map(|path| files(path)).collect::<Vec<_>>();
    if let Some(only) = set("VK_DRIVER_FILES").or_else(|| set("VK_ICD_FILENAMES")) {
        return listed(only);
    }
    let mut all = set("VK_ADD_DRIVER_FILES").map(listed).unwrap_or_default();
    let home = set("HOME").map(PathBuf::from);
    let in_home = |name, below: &str| match (set(name), &home) {
        (Some(folder), _) => vec![PathBuf::from(folder)],
        (None, Some(home)) => vec![home.join(below)],
        (None, None) => Vec::new(),
    };
    let folders = |name, usual: &str| paths(&set(name).unwrap_or_else(|| usual.into()));
    let searched = [
        in_home("XDG_CONFIG_HOME", ".config"),
        folders("XDG_CONFIG_DIRS", "/etc/xdg"),
        vec!["/usr/local/etc".into(), "/etc".into()],
        in_home("XDG_DATA_HOME", ".local/share"),
        folders("XDG_DATA_DIRS", "/usr/local/share:/usr/share"),
    ];
    for folder in searched.concat() {
        let folder = folder.join("vulkan/icd.d");
        if folder.is_dir() {
            all.extend(files(&folder));
        }
    }
    all
}

fn paths(list: &OsString) -> Vec<PathBuf> {
    split_paths(list).filter(|path| !path.as_os_str().is_empty()).collect()
}

/// The manifests in a folder, by name; of anything else, itself.
fn files(path: &Path) -> Vec<PathBuf> {
    let Ok(entries) = read_dir(path) else { return vec![path.to_owned()] };
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == "json"));
    files.sort();
    files
}

#[derive(Deserialize)]
struct Manifest {
    #[serde(rename = "ICD")]
    driver: Driver,
}

#[derive(Deserialize)]
struct Driver {
    library_path: PathBuf,
}

/// The driver's library as the manifest names it: a path, or a name for the system's search; or why there is
/// none.
pub(super) fn library(manifest: &Path) -> Result<PathBuf, String> {
    let problem = |why: &dyn std::fmt::Display| format!("{}: {why}", manifest.display());
    // A pipe would make us wait.
    if !metadata(manifest).map_err(|e| problem(&e))?.is_file() {
        return Err(problem(&"no file"));
    }
    let mut text = String::new();
    let file = File::open(manifest).map_err(|e| problem(&e))?;
    file.take(MOST_BYTES).read_to_string(&mut text).map_err(|e| problem(&e))?;
    let read: Manifest = serde_json::from_str(&text).map_err(|e| problem(&e))?;
    let path = read.driver.library_path;
    if path.as_os_str().is_empty() {
        return Err(problem(&"an empty library_path"));
    }
    // A bare name is the system's to find, any other relative path begins at the manifest.
    let is_name = path.components().count() == 1 && path.file_name() == Some(path.as_os_str());
    match manifest.parent() {
        Some(folder) if !is_name => Ok(folder.join(path)),
        _ => Ok(path),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{create_dir_all, write};

    /// What is found with these variables.
    fn found(variables: &[(&str, &Path)]) -> Vec<PathBuf> {
        manifests(|name| variables.iter().find(|(n, _)| *n == name).map(|(_, value)| (*value).into()))
    }

    #[test]
    fn folders_are_searched_in_the_order_of_the_loader() {
        let place = tempfile::tempdir().unwrap();
        let at = |name: &str| place.path().join(name);
        let made = [
            "config/vulkan/icd.d/b.json",
            "etc/vulkan/icd.d/a.json",
            "home/.local/share/vulkan/icd.d/a.json",
            "share/vulkan/icd.d/a.json",
            "share/vulkan/icd.d/b.json",
        ];
        for name in made {
            create_dir_all(at(name).parent().unwrap()).unwrap();
            write(at(name), "").unwrap();
        }
        write(at("share/vulkan/icd.d/readme.txt"), "").unwrap();
        let nowhere = at("nowhere");
        let usual = [
            ("HOME", &*at("home")),
            ("XDG_CONFIG_HOME", &at("config")),
            ("XDG_CONFIG_DIRS", &at("etc")),
            ("XDG_DATA_DIRS", &at("share")),
        ];
        // What this machine has itself is left out.
        let ours = |variables: &[(&str, &Path)]| -> Vec<PathBuf> {
            found(variables).into_iter().filter(|path| path.starts_with(place.path())).collect()
        };
        assert_eq!(ours(&usual), made.map(at));
        let mut with = usual.to_vec();
        let added = at("share/vulkan/icd.d/b.json");
        with.push(("VK_ADD_DRIVER_FILES", &added));
        assert_eq!(ours(&with)[0], added);
        assert_eq!(ours(&with)[1..], made.map(at));
        // Only what these list, though it is not there; a folder stands for its manifests.
        with.push(("VK_ICD_FILENAMES", &nowhere));
        assert_eq!(found(&with), std::slice::from_ref(&nowhere));
        let folder = at("share/vulkan/icd.d");
        with.push(("VK_DRIVER_FILES", &folder));
        assert_eq!(found(&with), [at(made[3]), at(made[4])]);
        let both = std::env::join_paths([&nowhere, &folder]).unwrap();
        let list = [("VK_DRIVER_FILES", Path::new(&both))];
        assert_eq!(found(&list), [nowhere.clone(), at(made[3]), at(made[4])]);
        // A variable that is set to nothing is not set.
        let empty = [("VK_DRIVER_FILES", Path::new("")), ("VK_ICD_FILENAMES", &*nowhere)];
        assert_eq!(found(&empty), [nowhere]);
    }

    #[test]
    fn libraries_are_named_by_path_or_by_name() {
        let place = tempfile::tempdir().unwrap();
        let manifest = place.path().join("driver.json");
        let read = |path: &str| {
            let text = format!(r#"{{"ICD": {{"library_path": {path:?}, "api_version": "1.3.0"}}}}"#);
            write(&manifest, text).unwrap();
            library(&manifest).unwrap()
        };
        assert_eq!(read("/usr/lib/libvulkan_lvp.so"), Path::new("/usr/lib/libvulkan_lvp.so"));
        assert_eq!(read("libvulkan_lvp.so"), Path::new("libvulkan_lvp.so"));
        assert_eq!(read("./libvulkan_lvp.so"), place.path().join("./libvulkan_lvp.so"));
        assert_eq!(read("../lib/x.so"), place.path().join("../lib/x.so"));
    }

    #[test]
    fn manifests_that_name_no_library_are_told_with_their_path() {
        let place = tempfile::tempdir().unwrap();
        let manifest = place.path().join("driver.json");
        let texts: [&[u8]; 9] = [
            b"",
            b"not JSON",
            b"[]",
            b"{}",
            br#"{"ICD": {}}"#,
            br#"{"ICD": {"library_path": 7}}"#,
            br#"{"ICD": {"library_path": ""}}"#,
            b"\xff\xfe",
            &[b' '; (MOST_BYTES + 9) as usize],
        ];
        for text in texts {
            write(&manifest, text).unwrap();
            let why = library(&manifest).unwrap_err();
            assert!(why.contains("driver.json: ") && !why.contains('\n') && why.len() < 300, "{why}");
        }
        assert!(library(&place.path().join("none.json")).unwrap_err().contains("none.json: "));
        assert!(library(place.path()).unwrap_err().ends_with(": no file"));
    }
}
