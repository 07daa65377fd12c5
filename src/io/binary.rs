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

/// Bytes of a number of this type.
pub(crate) fn size(kind: Kind) -> usize {
    match kind {
        Kind::I8 | Kind::U8 => 1,
        Kind::I16 | Kind::U16 => 2,
        Kind::I32 | Kind::U32 | Kind::F32 => 4,
        Kind::F64 => 8,
    }
}

/// A little-endian number of this type. `bytes` are as many as it has.
pub(crate) fn value_le(kind: Kind, bytes: &[u8]) -> f64 {
    let eight = widened(bytes);
    let low = eight as u32;
    match kind {
        Kind::I8 => f64::from(low as i8),
        Kind::U8 => f64::from(low as u8),
        Kind::I16 => f64::from(low as i16),
        Kind::U16 => f64::from(low as u16),
        Kind::I32 => f64::from(low as i32),
        Kind::U32 => f64::from(low),
        Kind::F32 => f64::from(f32::from_bits(low)),
        Kind::F64 => f64::from_bits(eight),
    }
}

/// Up to eight bytes, the lowest first, with zeros behind them.
pub(crate) fn widened(bytes: &[u8]) -> u64 {
    let mut eight = [0; 8];
    eight.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
    u64::from_le_bytes(eight)
}
