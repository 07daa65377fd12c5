//! The paper's models, from a folder or, without one, built-in models in their place; and CAD parts.

use anyhow::{Context as _, Result};
use rtfmesh::TriMesh;
use rtfmesh::io;
use rtfmesh::io::Encoding;
use rtfmesh::mesh::samples;
use std::path::{Path, PathBuf};

/// The name here, other file names, and the built-in model that stands in.
const KNOWN: [(&str, &[&str], Option<&str>); 11] = [
    ("rocker-arm", &["rocker", "rockerarm"], Some("torus")),
    ("kitten", &[], Some("bumpy-sphere")),
    ("botijo", &[], Some("genus3")),
    ("bunny", &["stanford-bunny"], Some("sphere")),
    ("moai", &[], None),
    ("egea", &[], None),
    ("fertility", &[], Some("genus3")),
    ("torus", &[], Some("torus")),
    ("homer", &[], Some("bumpy-sphere")),
    ("fandisk", &[], Some("box")),
    ("close-hemispheres", &["close-hemisphere"], Some("thin-plate")),
];

/// A mesh to remesh.
#[derive(Clone)]
pub struct Model {
    /// The name in the paper, in lower case.
    pub name: &'static str,
    /// The name in titles: its own, or that of the built-in model in its place.
    pub title: String,
    /// Whether it is the paper's model, so that the paper's figures can be compared.
    pub original: bool,
    /// The mesh as read.
    pub mesh: TriMesh,
}

/// Where models come from.
pub struct Models {
    folder: Option<PathBuf>,
}

impl Models {
    /// Models from a folder, or built-in ones.
    ///
    /// # Errors
    /// If it is no folder.
    pub fn new(folder: Option<PathBuf>) -> Result<Self> {
        if let Some(folder) = &folder {
            std::fs::read_dir(folder).with_context(|| format!("--meshes {}", folder.display()))?;
        }
        Ok(Self { folder })
    }

    /// A model; `None`, with a message, if there is none.
    ///
    /// # Errors
    /// If a file exists but cannot be read, or if the paper has no model of that name.
    pub fn load(&self, name: &str) -> Result<Option<Model>> {
        let known = KNOWN.into_iter().find(|(known, ..)| *known == name);
        let (name, others, sample) = known.with_context(|| format!("no model {name}"))?;
        let Some(folder) = &self.folder else {
            let Some(sample) = sample else {
                println!("{name}: skipped, no built-in model stands in for it");
                return Ok(None);
            };
            let title = format!("{name} ({sample})");
            return Ok(Some(Model { name, title, original: false, mesh: samples::sample(sample)? }));
        };
        let Some(path) = find(folder, name, others)? else {
            println!("{name}: skipped, not in {}", folder.display());
            return Ok(None);
        };
        let mesh = io::read(&path)?.mesh;
        Ok(Some(Model { name, title: name.to_owned(), original: true, mesh }))
    }
}

/// A part that bench/peers/parts.py made; `None`, with a message, if it did not.
///
/// # Errors
/// If the file cannot be read.
pub fn part(name: &'static str) -> Result<Option<Model>> {
    let path = Path::new("bench/peers/.parts").join(name).with_extension("ply");
    if !path.exists() {
        println!("{name}: skipped, bench/peers/setup.sh makes it");
        return Ok(None);
    }
    Ok(Some(Model { name, title: name.to_owned(), original: false, mesh: io::read(&path)?.mesh }))
}

/// The first mesh file with one of these names.
fn find(folder: &Path, name: &str, others: &[&str]) -> Result<Option<PathBuf>> {
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<_>>()?;
    files.sort();
    let fits = |path: &PathBuf| {
        let stem = path.file_stem().map(|s| s.to_string_lossy().to_lowercase().replace(['_', ' '], "-"));
        Encoding::of_name(path).is_some() && stem.is_some_and(|s| s == name || others.contains(&s.as_str()))
    };
    Ok(files.into_iter().find(fits))
}
