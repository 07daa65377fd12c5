//! Numbers in binary files.

use crate::mesh::attributes::Kind;

/// Appends `value` as a little-endian number of this type.
pub(crate) fn append_le(bytes: &mut Vec<u8>, kind: Kind, value: f64) {
    match kind {
        Kind::I8 => bytes.extend((value as i8).to_le_bytes()),
        Kind::U8 => bytes.extend((value as u8).to_le_bytes()),
        Kind::I16 => bytes.extend((value as i16).to_le_bytes()),
        Kind::U16 => bytes.extend((value as u16).to_le_bytes()),
        Kind::I32 => bytes.extend((value as i32).to_le_bytes()),
        Kind::U32 => bytes.extend((value as u32).to_le_bytes()),
        Kind::F32 => bytes.extend((value as f32).to_le_bytes()),
        Kind::F64 => bytes.extend(value.to_le_bytes()),
    }
}
