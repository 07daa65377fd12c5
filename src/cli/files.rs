//! Mesh files as commands name them: by a path, or `-` for standard input and output.

use super::heading::INPUT;
use super::progress::patience;
use super::terminal::{check_standard_output, tell};
use crate::error::{escaped, shown};
use anyhow::Result;
use rtfmesh::io;
use rtfmesh::io::{Encoding, Input, Loaded, Prepared, Reader, Writer};
use rtfmesh::mesh::attributes::Attributes;
use rtfmesh::{Error, TriMesh};
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

/// The input's format, where neither its name nor its content says.
#[derive(Debug, Clone, clap::Args)]
pub struct InputFormat {
    /// Format of the input, if neither content nor extension tells
    ///
    /// One of obj, ply, stl, off, gltf, glb, mesh, vtp, vtu, vtk, 3mf, xyz, pcd, las, e57, npy, nrrd, nii,
    /// mha and vti.
    #[arg(long, value_name = "FORMAT", help_heading = INPUT, hide_short_help = true)]
    input_format: Option<Encoding>,
    /// Folder from which files that the input refers to may be read [default: its own]
    ///
    /// Such files are buffers and images of glTF, for example. Folders below are allowed as well.
    #[arg(long, value_name = "DIR", help_heading = INPUT, hide_short_help = true)]
    files_from: Option<PathBuf>,
}

impl InputFormat {
    /// Reads a mesh from a file or standard input.
    ///
    /// # Errors
    /// [`Error::Input`] with the file's name.
    pub fn load(&self, path: &Path) -> rtfmesh::Result<Loaded> {
        let loaded = self.load_any(path, false)?.mesh_or_points().and_then(Loaded::with_faces);
        loaded.map_err(|error| error.in_file(input_name(path)))
    }

    /// Like [`InputFormat::load`], or points without faces, or a volume; `with_materials` asks for pictures
    /// and the like as well.
    pub fn load_any(&self, path: &Path, with_materials: bool) -> rtfmesh::Result<Input> {
        let (files_from, patience) = (self.files_from.clone(), patience());
        let reader = Reader::new().format(self.input_format).materials(with_materials);
        if !is_standard(path) {
            return reader.files_from(files_from).patience(patience).read_any(path);
        }
        let read = io::read_standard_input(&patience);
        let read = read.and_then(|bytes| reader.read_any_bytes(&bytes));
        read.map_err(|error| error.in_file(input_name(path)))
    }

    /// Like [`InputFormat::load`], for a second mesh: the format is not meant for it if it is a file.
    pub fn load_other(&self, path: &Path) -> rtfmesh::Result<Loaded> {
        self.for_other_file(path).load(path)
    }

    /// Like [`InputFormat::load_other`], or points without faces.
    pub fn load_other_or_points(&self, path: &Path) -> rtfmesh::Result<Loaded> {
        let loaded = self.for_other_file(path).load_any(path, false)?.mesh_or_points();
        loaded.map_err(|error| error.in_file(input_name(path)))
    }

    fn for_other_file(&self, path: &Path) -> Self {
        let input_format = self.input_format.filter(|_| is_standard(path));
        Self { input_format, files_from: self.files_from.clone() }
    }
}

/// Whether this is standard input or output.
pub fn is_standard(path: &Path) -> bool {
    path == Path::new("-")
}

/// The name of an input for messages.
pub fn input_name(path: &Path) -> &Path {
    if is_standard(path) { Path::new("standard input") } else { path }
}

/// Prints notes, such as what reading left out, to standard error.
pub fn tell_notes(path: &Path, notes: &[String]) {
    for note in notes {
        tell(&format!("note: {}: {}\n", shown(input_name(path)), escaped(note)));
    }
}

/// Where a mesh will be written.
pub struct Target<'a> {
    path: &'a Path,
    encoding: Encoding,
}

impl<'a> Target<'a> {
    /// `format` stands for what the extension says.
    ///
    /// # Errors
    /// [`Error::Output`] if nothing can be written there, [`Error::Usage`] for standard output without a
    /// format.
    pub fn new(path: &'a Path, format: Option<Encoding>) -> rtfmesh::Result<Self> {
        if format.is_some_and(|e| e.format.is_of_points() || e.format.is_of_volumes()) {
            let problem = "--format: this format cannot hold triangles";
            return Err(Error::usage(problem, "use obj, ply, stl, off, glb, mesh, vtp, vtu, vtk or 3mf"));
        }
        if !is_standard(path) {
            let encoding = format.map_or_else(|| io::target_encoding(path), Ok)?;
            io::check_text_target(path)?;
            return Ok(Self { path, encoding });
        }
        let Some(encoding) = format else {
            let problem = "standard output has no extension that determines the format";
            return Err(Error::usage(problem, "add --format, for example --format ply"));
        };
        check_standard_output()?;
        let for_people = encoding.format.is_written_as_text() && !encoding.gzip;
        if !for_people && std::io::stdout().is_terminal() {
            let problem = format!("{encoding} is binary and cannot be printed to a terminal");
            return Err(Error::usage(problem, "redirect standard output to a file or a pipe"));
        }
        Ok(Self { path, encoding })
    }

    /// The format of the file.
    pub fn format(&self) -> io::Format {
        self.encoding.format
    }

    /// What the format rounds away or drops.
    pub fn notes(&self, mesh: &TriMesh, attributes: &Attributes) -> Vec<String> {
        let rounded = io::lost_precision_note(mesh, self.encoding.format);
        rounded.into_iter().chain(io::lost_attributes_note(attributes, self.encoding.format)).collect()
    }

    /// Writes, whole or not at all; to standard output once everything is ready.
    ///
    /// # Errors
    /// [`Error::Output`], or what standard output says.
    pub fn write(&self, mesh: &TriMesh, attributes: &Attributes, quiet: bool) -> Result<()> {
        self.write_all(mesh, attributes, &[], quiet)
    }

    /// Like [`Target::write`], with further files: all or none.
    ///
    /// # Errors
    /// As [`Target::write`].
    pub fn write_all(
        &self,
        mesh: &TriMesh,
        attributes: &Attributes,
        others: &[(&Path, Vec<u8>)],
        quiet: bool,
    ) -> Result<()> {
        let notes = self.notes(mesh, attributes);
        // Whatever may fail is done before the first file is in its place.
        let others = others.iter().map(|(path, bytes)| Prepared::of_bytes(path, bytes));
        let others = others.collect::<rtfmesh::Result<Vec<_>>>()?;
        let writer = Writer::new().attributes(attributes).encoding(self.encoding);
        if is_standard(self.path) {
            let bytes = writer.encode("standard output", mesh)?;
            let mut out = std::io::stdout().lock();
            out.write_all(&bytes)?;
            out.flush()?;
        } else {
            writer.prepare(self.path, mesh)?.put()?;
        }
        others.into_iter().try_for_each(Prepared::put)?;
        for note in notes.iter().filter(|_| !quiet) {
            tell(&format!("note: {}: {note}\n", shown(self.path)));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_that_cannot_be_written_leaves_the_mesh_alone() {
        let folder = tempfile::tempdir().unwrap();
        let mesh = rtfmesh::mesh::samples::sample("box").unwrap();
        let path = folder.path().join("a.ply");
        std::fs::write(&path, "as it was").unwrap();
        let target = Target::new(&path, None).unwrap();
        let report = folder.path().join("gone/report.json");
        let page = folder.path().join("page.html");
        let write = |texts: &[(&Path, Vec<u8>)]| target.write_all(&mesh, &Attributes::default(), texts, true);
        let texts = [(page.as_path(), b"page".to_vec()), (report.as_path(), b"report".to_vec())];
        assert!(write(&texts).unwrap_err().to_string().contains("there is no folder"));
        assert_eq!(std::fs::read(&path).unwrap(), b"as it was");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        write(&texts[..1]).unwrap();
        assert_eq!(std::fs::read(&page).unwrap(), b"page");
        assert_ne!(std::fs::read(&path).unwrap(), b"as it was");
    }
}
