//! Typed device buffers.

use super::copies::par_copy;
use super::device::{Device, Shared, lock};
use super::errors::vk_error;
use super::transfers::{Content, Transfer};
use crate::gpu::Recorder;
use crate::{Error, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::marker::PhantomData;
use std::sync::{Arc, Mutex};

/// Minimum alignment of a buffer's memory, in bytes.
const ALIGNMENT: u64 = 16;

/// `len` values of type `T` in device memory.
pub struct Buffer<T> {
    raw: Arc<RawBuffer>,
    /// Where the values begin, in bytes; 0 unless this is a window.
    offset: u64,
    len: usize,
    element: PhantomData<T>,
}

/// A part of a buffer as a kernel is given it.
#[derive(Clone, Copy)]
pub struct Bound<'a> {
    pub(super) raw: &'a Arc<RawBuffer>,
    pub(super) offset: u64,
    pub(super) bytes: u64,
}

/// An untyped buffer, for [`Buffer`] and for staging copies.
pub struct RawBuffer {
    pub(super) handle: vk::Buffer,
    pub(super) id: u64,
    name: String,
    bytes: u64,
    usage: vk::BufferUsageFlags,
    allocation: Option<Allocation>,
    /// Parts that were read as texels.
    views: Mutex<Vec<(TexelPart, vk::BufferView)>>,
    shared: Arc<Shared>,
}

/// Where a part of a buffer begins and how long it is, in bytes, and the format of its texels.
type TexelPart = (u64, u64, vk::Format);

impl<T: bytemuck::Pod> Buffer<T> {
    /// An uninitialised buffer with a dotted name such as `rtf.face.polygons`.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] with the name, if it is larger than a kernel can be given or than what is free;
    /// those of [`Recorder::submit`], since waiting uploads are sent where memory is short.
    pub fn new(device: &Device, name: &str, len: usize) -> Result<Self> {
        let bytes = Self::bytes_for(len);
        let most = device.info().limits.storage_buffer_bytes;
        if bytes > most {
            return Err(Error::OutOfMemory {
                what: name.to_owned(),
                bytes,
                problem: format!("but device '{}' allows at most {most} in one buffer", device.info().name),
                remedy: "ask for fewer vertices, or use a device with larger buffers".to_owned(),
                source: None,
            });
        }
        Self::of_windows(device, name, len)
    }

    /// Like [`Buffer::new`], but it may be larger than a kernel can be given: kernels get windows of it.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] with the name, if it is larger than what is free; else as [`Buffer::new`].
    pub fn of_windows(device: &Device, name: &str, len: usize) -> Result<Self> {
        let bytes = Self::bytes_for(len);
        let mut usage = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::INDIRECT_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        if device.shared.reads_texels {
            usage |= vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER;
        }
        device.transfers.make_room(&device.shared, bytes)?;
        let raw = RawBuffer::new(&device.shared, name, bytes, usage, MemoryLocation::GpuOnly)?;
        Ok(Self { raw: Arc::new(raw), offset: 0, len, element: PhantomData })
    }

    /// Vulkan has no empty buffers.
    fn bytes_for(len: usize) -> u64 {
        (len.max(1) as u64).saturating_mul(size_of::<T>() as u64).next_multiple_of(16)
    }

    /// A buffer with the given content, from the next submission on.
    ///
    /// # Errors
    /// As [`Buffer::new`].
    pub fn from_slice(device: &Device, name: &str, values: &[T]) -> Result<Self> {
        let buffer = Self::new(device, name, values.len())?;
        buffer.write(device, values)?;
        Ok(buffer)
    }

    /// Overwrites the start with `values` at the beginning of the next submission, ahead of all that was
    /// recorded for it.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] for the staging copy; [`Error::Internal`] if the buffer is too short.
    pub fn write(&self, device: &Device, values: &[T]) -> Result<()> {
        let bytes = self.staged_bytes(values)?;
        if bytes.is_empty() {
            return Ok(());
        }
        let (shared, usage) = (&device.shared, vk::BufferUsageFlags::TRANSFER_SRC);
        let mut staging = device.transfers.staging(shared, bytes.len(), usage)?;
        staging.put(bytes)?;
        let (target, offset, bytes) = (Arc::downgrade(&self.raw), self.offset, bytes.len() as u64);
        let transfer = Transfer { target, offset, bytes, content: Content::Staged(staging) };
        device.transfers.add(shared, transfer)
    }

    /// The bytes of `values` if they fit.
    pub(super) fn staged_bytes<'a>(&self, values: &'a [T]) -> Result<&'a [u8]> {
        if values.len() > self.len {
            let name = self.raw.name();
            return Err(Error::Internal(format!("{} values do not fit in {name}", values.len())));
        }
        Ok(bytemuck::cast_slice(values))
    }

    /// A buffer of zeros, from the next submission on.
    ///
    /// # Errors
    /// As [`Buffer::new`].
    pub fn zeros(device: &Device, name: &str, len: usize) -> Result<Self> {
        Self::new(device, name, len)?.zeroed(device)
    }

    /// Itself, with all values set to zero at the beginning of the next submission.
    ///
    /// # Errors
    /// [`Error::Device`].
    pub fn zeroed(self, device: &Device) -> Result<Self> {
        let Bound { raw, offset, bytes } = self.bound();
        let transfer = Transfer { target: Arc::downgrade(raw), offset, bytes, content: Content::Word(0) };
        device.transfers.add(&device.shared, transfer)?;
        Ok(self)
    }

    /// Copies the content back; waits for the device.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] or [`Error::DeviceLost`].
    pub fn to_vec(&self, device: &Device) -> Result<Vec<T>> {
        let mut recorder = Recorder::new(device)?;
        let copy = recorder.download(self)?;
        recorder.submit()?.read(&copy)
    }
}

impl<T> Buffer<T> {
    /// Number of values.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are no values.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The `len` values from `first` on, as a buffer that shares the memory. Vulkan may ask windows to begin
    /// at multiples of 256 bytes.
    ///
    /// # Errors
    /// [`Error::Internal`] if the buffer ends before that.
    pub fn window(&self, first: usize, len: usize) -> Result<Self> {
        if first + len > self.len {
            let name = self.raw.name();
            return Err(Error::Internal(format!("{name} has no {len} values from {first} on")));
        }
        let offset = self.offset + (first * size_of::<T>()) as u64;
        Ok(Self { raw: self.raw.clone(), offset, len, element: PhantomData })
    }

    /// Where the values begin in [`Buffer::raw`], in bytes.
    pub(super) fn offset(&self) -> u64 {
        self.offset
    }

    /// The values as a kernel is given them.
    pub fn bound(&self) -> Bound<'_> {
        // Vulkan has no empty ranges.
        let bytes = (self.len.max(1) * size_of::<T>()).next_multiple_of(4) as u64;
        Bound { raw: &self.raw, offset: self.offset, bytes }
    }

    /// The untyped buffer; a recorder that uses it shares it until the device is done.
    pub fn raw(&self) -> &Arc<RawBuffer> {
        &self.raw
    }
}

impl RawBuffer {
    pub(super) fn new(
        shared: &Arc<Shared>,
        name: &str,
        bytes: u64,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Result<Self> {
        shared.require_own()?;
        let too_large = |problem: String| Error::OutOfMemory {
            what: name.to_owned(),
            bytes,
            problem,
            remedy: "ask for fewer vertices, or close other programs".to_owned(),
            source: None,
        };
        if let (Some(most), false) = (shared.memory_bytes, shared.may_allocate(bytes)) {
            return Err(too_large(format!("but all buffers together may take {most}")));
        }
        let info =
            vk::BufferCreateInfo::default().size(bytes).usage(usage).sharing_mode(vk::SharingMode::EXCLUSIVE);
        // SAFETY: the device is alive (Arc); `info` outlives the call.
        let handle = unsafe { shared.raw.create_buffer(&info, None) }
            .map_err(|e| too_large(format!("which the device refused ({e})")).caused_by(e))?;
        // From here on Drop frees what exists.
        let mut this = Self {
            handle,
            id: shared.new_id(),
            name: name.to_owned(),
            bytes: 0,
            usage,
            allocation: None,
            views: Mutex::default(),
            shared: shared.clone(),
        };
        // SAFETY: the handle was just made.
        let mut requirements = unsafe { shared.raw.get_buffer_memory_requirements(handle) };
        // Downloads are read in place, and vectors of four numbers are aligned to that.
        requirements.alignment = requirements.alignment.max(ALIGNMENT);
        let allocation = shared
            .allocator()
            .allocate(&AllocationCreateDesc {
                name,
                requirements,
                location,
                linear: true,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            })
            .map_err(|e| too_large(format!("which the device does not have ({e})")).caused_by(e))?;
        this.bytes = bytes;
        shared.count_allocated(bytes);
        // SAFETY: the allocation fits the requirements and lives as long as the buffer.
        let bound =
            unsafe { shared.raw.bind_buffer_memory(handle, allocation.memory(), allocation.offset()) };
        this.allocation = Some(allocation);
        bound.map_err(|e| vk_error(&format!("binding memory to buffer {name}"), e))?;
        shared.name_object(handle, name);
        Ok(this)
    }

    /// Dotted name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Length in bytes.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    pub(super) fn usage(&self) -> vk::BufferUsageFlags {
        self.usage
    }

    /// A part as texels of a format.
    ///
    /// # Errors
    /// [`Error::Device`] if the driver has no memory for it.
    pub(super) fn texels(&self, offset: u64, bytes: u64, format: vk::Format) -> Result<vk::BufferView> {
        let part = (offset, bytes, format);
        let mut views = lock(&self.views);
        if let Some((_, view)) = views.iter().find(|(known, _)| *known == part) {
            return Ok(*view);
        }
        let info = vk::BufferViewCreateInfo::default()
            .buffer(self.handle)
            .format(format)
            .offset(offset)
            .range(bytes);
        // SAFETY: device and buffer are alive; `info` outlives the call.
        let view = unsafe { self.shared.raw.create_buffer_view(&info, None) }
            .map_err(|e| vk_error(&format!("reading buffer {} as texels", self.name), e))?;
        views.push((part, view));
        Ok(view)
    }

    /// The bytes if mapped to the host; empty for device-only memory.
    pub(super) fn mapped(&self) -> &[u8] {
        self.allocation.as_ref().and_then(Allocation::mapped_slice).unwrap_or_default()
    }

    /// Overwrites the start of memory that is mapped to the host.
    ///
    /// # Errors
    /// [`Error::Internal`] if it is not mapped, or too short.
    pub(super) fn put(&mut self, bytes: &[u8]) -> Result<()> {
        let mapped = self.allocation.as_mut().and_then(Allocation::mapped_slice_mut).unwrap_or_default();
        let start = mapped.get_mut(..bytes.len());
        par_copy(bytes, start.ok_or_else(|| Error::Internal("staging memory is not mapped".to_owned()))?);
        Ok(())
    }
}

impl Drop for RawBuffer {
    fn drop(&mut self) {
        if !self.shared.is_own() {
            return;
        }
        if let Some(allocation) = self.allocation.take() {
            // The allocator fails here only if its records are corrupt; the memory is then freed with the
            // device.
            let _ = self.shared.allocator().free(allocation);
            self.shared.count_freed(self.bytes);
        }
        // SAFETY: recorders share what they use until the device is done, so nothing uses it any more.
        unsafe {
            for (_, view) in lock(&self.views).drain(..) {
                self.shared.raw.destroy_buffer_view(view, None);
            }
            self.shared.raw.destroy_buffer(self.handle, None);
        }
    }
}
