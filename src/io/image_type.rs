//! Which kind of image some bytes are. What a name claims is no matter: any other file could be given away as
//! an image.

use imagesize::{Compression, ImageSize, ImageType};

/// Images have at most this many pixels along a side, the most that JPEG has.
const MOST_PIXELS: usize = 0xffff;

/// The media type of an image, if its header is whole and tells a size; `None` if glTF cannot have images of
/// this type.
pub(crate) fn image_type(bytes: &[u8]) -> Option<&'static str> {
    let media_type = match imagesize::image_type(bytes).ok()? {
        ImageType::Png => "image/png",
        ImageType::Jpeg => "image/jpeg",
        ImageType::Webp => "image/webp",
        ImageType::Ktx2 => "image/ktx2",
        ImageType::Heif(Compression::Av1) => "image/avif",
        _ => return None,
    };
    let ImageSize { width, height } = imagesize::blob_size(bytes).ok()?;
    let is_possible = |side: usize| (1..=MOST_PIXELS).contains(&side);
    (is_possible(width) && is_possible(height)).then_some(media_type)
}
