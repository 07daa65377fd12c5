//! NIfTI-1, the format of brain imaging, header and values in one file. Places are those of its transform:
//! right, anterior, superior.

use glam::{DAffine3, DMat3, DQuat, DVec3};
use nifti::{Endianness, NiftiHeader, NiftiType};

use super::Volume;
use super::raw::{Layout, Number, check_frame, size};
use crate::io::checks::cut_off;
use crate::mesh::attributes::Kind;
use crate::{Error, Result};

/// Bytes of the header with its extension flag.
const HEADER: usize = 352;
const MAGIC: std::ops::Range<usize> = 344..348;

/// Whether a file begins as NIfTI does.
pub(crate) fn starts(bytes: &[u8]) -> bool {
    let is_second = bytes.get(4..8) == Some(b"n+2\0");
    is_second || bytes.get(MAGIC).is_some_and(|magic| magic == b"n+1\0" || magic == b"ni1\0")
}

pub(crate) fn parse(bytes: &[u8]) -> Result<Volume> {
    let refuse = |problem: String, remedy: &str| Error::input(Some("the header".to_owned()), problem, remedy);
    match bytes.get(MAGIC) {
        _ if bytes.get(4..8) == Some(b"n+2\0") => {
            let remedy = "write it as NIfTI-1, for example with nibabel";
            return Err(refuse("NIfTI-2 is not supported".to_owned(), remedy));
        }
        Some(b"n+1\0") => {}
        Some(b"ni1\0") => {
            let remedy = "write both into one .nii file";
            return Err(refuse("the values are in another file".to_owned(), remedy));
        }
        _ => return Err(refuse("this is not a NIfTI-1 file".to_owned(), "give one, or set its format")),
    }
    let read = NiftiHeader::from_reader(bytes);
    let header = read.map_err(|error| refuse(format!("it cannot be read ({error})"), "repair it"))?;
    let lengths = header.dim().map_err(|error| refuse(format!("{error}"), "repair it"))?;
    let lengths: Vec<u64> = lengths.iter().map(|length| u64::from(*length)).collect();
    let (size, note) = size(&lengths)?;
    let number = header.data_type().ok().and_then(number).ok_or_else(|| {
        let problem = format!("values of type {} are not supported", type_name(header.datatype));
        refuse(problem, "write one real number per node, such as FLOAT32")
    })?;
    let begin = f64::from(header.vox_offset).clamp(0.0, u32::MAX.into()) as usize;
    let begin = begin.max(HEADER);
    let Some(values) = bytes.get(begin..) else {
        return Err(cut_off(format!("byte {begin}"), "there are no values"));
    };
    let frame = frame(&header);
    check_frame(&frame)?;
    let slope = f64::from(header.scl_slope);
    let has_scale = slope.is_finite() && slope != 0.0 && header.scl_inter.is_finite();
    let layout = Layout {
        size,
        number,
        is_big_endian: header.endianness == Endianness::Big,
        is_last_fastest: false,
        scale: if has_scale { [slope, header.scl_inter.into()] } else { [1.0, 0.0] },
    };
    layout.read(values, &format!("byte {begin}"), frame, note.into_iter().collect())
}

/// The name of a type in the standard, with its code.
fn type_name(code: i16) -> String {
    let name = match code {
        1 => "BINARY, one bit each",
        32 => "COMPLEX64, pairs of 32-bit numbers",
        128 => "RGB24, colours",
        1536 => "FLOAT128, 128-bit numbers",
        1792 => "COMPLEX128, pairs of 64-bit numbers",
        2048 => "COMPLEX256, pairs of 128-bit numbers",
        2304 => "RGBA32, colours with opacity",
        other => return format!("{other}, which the standard does not have,"),
    };
    format!("{code} ({name})")
}

fn number(kind: NiftiType) -> Option<Number> {
    Some(match kind {
        NiftiType::Uint8 => Kind::U8.into(),
        NiftiType::Int8 => Kind::I8.into(),
        NiftiType::Int16 => Kind::I16.into(),
        NiftiType::Uint16 => Kind::U16.into(),
        NiftiType::Int32 => Kind::I32.into(),
        NiftiType::Uint32 => Kind::U32.into(),
        NiftiType::Int64 => Number::I64,
        NiftiType::Uint64 => Number::U64,
        NiftiType::Float32 => Kind::F32.into(),
        NiftiType::Float64 => Kind::F64.into(),
        _ => return None,
    })
}

/// The transform that the header prefers: a matrix, else a rotation, else the spacing alone.
fn frame(header: &NiftiHeader) -> DAffine3 {
    let vector = |values: [f32; 3]| DVec3::from_array(values.map(f64::from));
    let spacing = vector([header.pixdim[1], header.pixdim[2], header.pixdim[3]]).abs();
    if header.sform_code > 0 {
        let rows = [header.srow_x, header.srow_y, header.srow_z];
        let column = |k: usize| vector([rows[0][k], rows[1][k], rows[2][k]]);
        return DAffine3 {
            matrix3: DMat3::from_cols(column(0), column(1), column(2)),
            translation: column(3),
        };
    }
    if header.qform_code <= 0 {
        return DAffine3::from_scale(spacing);
    }
    let imaginary = vector([header.quatern_b, header.quatern_c, header.quatern_d]);
    let real = (1.0 - imaginary.length_squared()).max(0.0).sqrt();
    let rotation = DQuat::from_xyzw(imaginary.x, imaginary.y, imaginary.z, real).normalize();
    // The first number tells left-handed axes.
    let turned = if header.pixdim[0] < 0.0 { -1.0 } else { 1.0 };
    DAffine3 {
        matrix3: DMat3::from_quat(rotation) * DMat3::from_diagonal(spacing * DVec3::new(1.0, 1.0, turned)),
        translation: vector([header.quatern_x, header.quatern_y, header.quatern_z]),
    }
}
