//! Opens all that is read: regular files, and pipes given by name. Nothing else may be opened, since devices
//! never end, and opening a pipe that nobody writes to may wait for ever.

use std::fs::{File, FileType};
use std::io;
use std::io::{ErrorKind, Read};
use std::path::Path;
use std::time::Instant;

use super::checks::reserve;
use crate::{Error, ProgressToken, Result};

/// Maximum number of bytes that are read from a pipe, whose length is unknown.
const MAX_PIPE_BYTES: u64 = 8 << 30;
/// Bytes read at a time.
const CHUNK: usize = 1 << 16;

/// When to stop waiting for a pipe or for standard input.
#[derive(Debug, Clone, Default)]
pub struct Patience {
    /// Reading ends with [`Error::Cancelled`] once this is cancelled.
    pub token: ProgressToken,
    /// Reading fails if the pipe has not ended by then; `None` waits for ever.
    pub deadline: Option<Instant>,
}

impl Patience {
    fn poll(&self) -> Result<()> {
        self.token.poll()?;
        if self.deadline.is_none_or(|deadline| Instant::now() < deadline) {
            return Ok(());
        }
        let problem = "the program that writes to the pipe did not finish within the time limit";
        Err(Error::input(None, problem, "check that program, or allow more time"))
    }
}

/// The content of the regular file or pipe at `path`.
///
/// # Errors
///
/// [`Error::Input`] without a path: the file is missing, unreadable, a directory or a device, or a pipe that
/// has too much or does not end in time; [`Error::OutOfMemory`]; [`Error::Cancelled`].
pub(crate) fn read_file_bytes(path: &Path, patience: &Patience) -> Result<Vec<u8>> {
    let kind = std::fs::metadata(path).map_err(unreadable)?.file_type();
    if is_pipe(kind) { read_named_pipe(path, patience) } else { read_regular_file(path) }
}

/// Like [`read_file_bytes`], for a regular file only.
pub(crate) fn read_regular_file(path: &Path) -> Result<Vec<u8>> {
    refuse_irregular(std::fs::metadata(path).map_err(unreadable)?.file_type())?;
    let file = open_at_once(path).map_err(unreadable)?;
    // Another file may have taken its place.
    let known = file.metadata().map_err(unreadable)?;
    refuse_irregular(known.file_type())?;
    // Files of the system have more than they say.
    read_at_most(file, known.len().max(MAX_PIPE_BYTES), Some(known.len()), |_| Ok(()))
}

fn refuse_irregular(kind: FileType) -> Result<()> {
    if kind.is_dir() {
        return Err(Error::input(None, "this is a directory", "give a mesh file"));
    }
    if !kind.is_file() {
        let remedy = "give a file, or - for standard input";
        return Err(Error::input(None, "this is not a regular file", remedy));
    }
    Ok(())
}

fn unreadable(error: io::Error) -> Error {
    let (problem, remedy) = match error.kind() {
        ErrorKind::NotFound => ("there is no such file".to_owned(), "check the name and the folder"),
        ErrorKind::PermissionDenied => (
            "there is no permission to read the file".to_owned(),
            "check the permissions of the file and \
            its folder",
        ),
        _ => (format!("the file cannot be read ({error})"), "check the path and the disk"),
    };
    Error::input(None, problem, remedy).caused_by(error)
}

/// All that there is to read. `length` is that of a regular file; for anything else, `ready` waits for each
/// part.
fn read_at_most<R: Read>(
    mut from: R,
    most: u64,
    length: Option<u64>,
    ready: impl Fn(&R) -> Result<()>,
) -> Result<Vec<u8>> {
    let (mut bytes, mut chunk) = (Vec::new(), vec![0; CHUNK]);
    let expected = length.map_or(0, |length| usize::try_from(length).unwrap_or(usize::MAX));
    reserve(&mut bytes, expected, "the content of a file")?;
    loop {
        ready(&from)?;
        let count = match from.read(&mut chunk) {
            Ok(0) => return Ok(bytes),
            Ok(count) => count,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) if error.kind() == ErrorKind::WouldBlock && length.is_none() => continue,
            Err(error) => return Err(unreadable(error)),
        };
        if bytes.len() as u64 + count as u64 > most {
            let problem = format!("it does not end within {most} bytes");
            return Err(Error::input(None, problem, "check what writes to it, or give a file"));
        }
        reserve(&mut bytes, count, "the content of a file")?;
        bytes.extend_from_slice(chunk.get(..count).unwrap_or_default());
    }
}

/// The content of standard input.
///
/// # Errors
///
/// As [`crate::io::read`], without a path.
#[cfg(unix)]
pub fn read_standard_input(patience: &Patience) -> Result<Vec<u8>> {
    read_at_most(io::stdin().lock(), MAX_PIPE_BYTES, None, |input| unix::wait_for(input, patience))
}

/// The content of standard input.
///
/// # Errors
///
/// As [`crate::io::read`], without a path.
#[cfg(not(unix))]
pub fn read_standard_input(patience: &Patience) -> Result<Vec<u8>> {
    read_at_most(io::stdin().lock(), MAX_PIPE_BYTES, None, |_| patience.poll())
}

#[cfg(unix)]
use unix::{is_pipe, open_at_once, read_named_pipe};

#[cfg(unix)]
mod unix {
    use std::os::fd::AsFd;
    use std::os::unix::fs::FileTypeExt;

    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::fs::{Mode, OFlags, open};
    use rustix::io::Errno;

    use super::*;

    /// How often to look whether to stop waiting.
    const INTERVAL: Timespec = Timespec { tv_sec: 0, tv_nsec: 50_000_000 };

    pub fn is_pipe(kind: FileType) -> bool {
        kind.is_fifo()
    }

    /// Opens for reading without waiting for a writer.
    pub fn open_at_once(path: &Path) -> io::Result<File> {
        let flags = OFlags::RDONLY | OFlags::NONBLOCK | OFlags::CLOEXEC | OFlags::NOCTTY;
        Ok(File::from(open(path, flags, Mode::empty())?))
    }

    pub fn read_named_pipe(path: &Path, patience: &Patience) -> Result<Vec<u8>> {
        let pipe = open_at_once(path).map_err(unreadable)?;
        let kind = pipe.metadata().map_err(unreadable)?.file_type();
        if !is_pipe(kind) {
            refuse_irregular(kind)?;
        }
        read_at_most(pipe, MAX_PIPE_BYTES, None, |pipe| wait_for(pipe, patience))
    }

    /// Waits until there is something to read, or the last writer has closed the pipe.
    pub fn wait_for(pipe: &impl AsFd, patience: &Patience) -> Result<()> {
        loop {
            patience.poll()?;
            match poll(&mut [PollFd::new(pipe, PollFlags::IN)], Some(&INTERVAL)) {
                Ok(0) | Err(Errno::INTR) => {}
                Ok(_) => return Ok(()),
                Err(error) => return Err(unreadable(error.into())),
            }
        }
    }
}

#[cfg(not(unix))]
fn is_pipe(_: FileType) -> bool {
    false
}

#[cfg(not(unix))]
fn open_at_once(path: &Path) -> io::Result<File> {
    File::open(path)
}

#[cfg(not(unix))]
fn read_named_pipe(path: &Path, _: &Patience) -> Result<Vec<u8>> {
    read_regular_file(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_end_is_refused_at_its_limit() {
        let error = read_at_most(io::repeat(0), 1 << 20, None, |_| Ok(())).unwrap_err();
        assert!(error.to_string().contains("does not end within 1048576 bytes"), "{error}");
        assert_eq!(
            read_at_most(io::repeat(7).take(1 << 20), 1 << 20, None, |_| Ok(())).unwrap().len(),
            1 << 20
        );
    }
}
