//! What a submission that is done has copied to the host.

use super::copies::par_copy;
use super::recorder::Recorder;
use crate::{Error, Result};
use bytemuck::allocation::zeroed_vec;
use std::marker::PhantomData;

/// A copy to the host, which [`Submitted::read`] returns.
pub struct Download<T> {
    slot: usize,
    len: usize,
    element: PhantomData<T>,
}

/// A finished submission with its downloads.
pub struct Submitted {
    recorder: Recorder,
}

impl<T> Download<T> {
    /// Of this many values in a staging buffer of the recorder.
    pub(super) fn new(slot: usize, len: usize) -> Self {
        Self { slot, len, element: PhantomData }
    }
}

impl Submitted {
    /// Of a recorder whose commands are done.
    pub(super) fn new(recorder: Recorder) -> Self {
        Self { recorder }
    }

    /// The values of a download of this submission.
    ///
    /// # Errors
    /// [`Error::Internal`] if `download` belongs to another one.
    pub fn read<T: bytemuck::Pod>(&self, download: &Download<T>) -> Result<Vec<T>> {
        let bytes = self.bytes(download)?;
        let mut values: Vec<T> = zeroed_vec(download.len);
        par_copy(bytes, bytemuck::cast_slice_mut(&mut values));
        Ok(values)
    }

    /// The first value of a download.
    ///
    /// # Errors
    /// As [`Submitted::read`], and [`Error::Internal`] if there is none.
    pub fn first<T: bytemuck::Pod>(&self, download: &Download<T>) -> Result<T> {
        let first = self.view(download)?.first().copied();
        first.ok_or_else(|| Error::Internal("a download is empty".to_owned()))
    }

    /// The values where they are, without a copy of them.
    ///
    /// # Errors
    /// As [`Submitted::read`].
    pub fn view<T: bytemuck::Pod>(&self, download: &Download<T>) -> Result<&[T]> {
        let bytes = self.bytes(download)?;
        bytemuck::try_cast_slice(bytes).map_err(|e| Error::Internal(format!("a download's memory: {e}")))
    }

    fn bytes<T>(&self, download: &Download<T>) -> Result<&[u8]> {
        let staging = self.recorder.staging.get(download.slot);
        staging
            .and_then(|s| s.mapped().get(..download.len * size_of::<T>()))
            .ok_or_else(|| Error::Internal("a download was read from another submission".to_owned()))
    }
}
