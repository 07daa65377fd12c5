//! VTK's files made byte by byte, in every form that its writers have.

use std::fmt::Write as _;
use std::io::Write as _;

use super::files::base64;

/// How a file has its numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Form {
    pub mode: Mode,
    pub is_big_endian: bool,
    /// Bytes of the numbers that say how many follow.
    pub header: usize,
    /// Bytes of a block, if numbers are packed.
    pub block: Option<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Mode {
    Ascii,
    Inline,
    Raw,
    Base64,
}

/// All forms.
pub fn forms() -> Vec<Form> {
    let mut all = vec![Form { mode: Mode::Ascii, is_big_endian: false, header: 4, block: None }];
    for mode in [Mode::Inline, Mode::Raw, Mode::Base64] {
        for is_big_endian in [false, true] {
            for header in [4, 8] {
                for block in [None, Some(24), Some(1 << 15)] {
                    all.push(Form { mode, is_big_endian, header, block });
                }
            }
        }
    }
    all
}

/// An array: its section, attributes, and numbers of a type.
pub struct Array<'t> {
    pub section: &'t str,
    pub kind: &'t str,
    pub name: &'t str,
    pub components: usize,
    pub values: Vec<f64>,
}

/// The bytes of one number.
pub fn number(kind: &str, value: f64, is_big_endian: bool) -> Vec<u8> {
    let mut bytes = match kind {
        "Int8" => (value as i8).to_le_bytes().to_vec(),
        "UInt8" => (value as u8).to_le_bytes().to_vec(),
        "Int16" => (value as i16).to_le_bytes().to_vec(),
        "UInt16" => (value as u16).to_le_bytes().to_vec(),
        "Int32" => (value as i32).to_le_bytes().to_vec(),
        "UInt32" => (value as u32).to_le_bytes().to_vec(),
        "Int64" => (value as i64).to_le_bytes().to_vec(),
        "UInt64" => (value as u64).to_le_bytes().to_vec(),
        "Float32" => (value as f32).to_le_bytes().to_vec(),
        "Float64" => value.to_le_bytes().to_vec(),
        other => panic!("no type {other}"),
    };
    if is_big_endian {
        bytes.reverse();
    }
    bytes
}

impl Form {
    fn header_number(&self, value: usize) -> Vec<u8> {
        number(if self.header == 8 { "UInt64" } else { "UInt32" }, value as f64, self.is_big_endian)
    }

    /// The parts that base64 has one text for each of: header and numbers, packed ones apart.
    fn parts(&self, data: &[u8]) -> Vec<Vec<u8>> {
        let Some(block) = self.block else {
            return vec![[self.header_number(data.len()), data.to_vec()].concat()];
        };
        let packed: Vec<Vec<u8>> = data
            .chunks(block)
            .map(|part| {
                let mut packer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
                packer.write_all(part).unwrap();
                packer.finish().unwrap()
            })
            .collect();
        let last = data.len() % block;
        let mut header = [packed.len(), block, last].map(|value| self.header_number(value)).concat();
        packed.iter().for_each(|part| header.extend(self.header_number(part.len())));
        vec![header, packed.concat()]
    }

    /// The numbers of an array as its element or the appended part has them.
    fn encoded(&self, data: &[u8]) -> Vec<u8> {
        let parts = self.parts(data);
        if self.mode == Mode::Raw {
            return parts.concat();
        }
        parts.iter().map(|part| base64(part)).collect::<String>().into_bytes()
    }

    /// A file of one piece. `pieces` are the attributes of dataset and piece, `data` those of `PointData`.
    pub fn file(&self, kind: &str, [dataset, piece, data]: [&str; 3], arrays: &[Array]) -> Vec<u8> {
        let order = if self.is_big_endian { "BigEndian" } else { "LittleEndian" };
        let packer = self.block.map_or("", |_| " compressor=\"vtkZLibDataCompressor\"");
        let mut text = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"{order}\" \
             header_type=\"UInt{}\"{packer}>\n<{kind}{dataset}>\n<Piece {piece}>\n",
            8 * self.header
        );
        let mut appended = Vec::new();
        let mut open = "";
        for array in arrays {
            if open != array.section {
                if !open.is_empty() {
                    writeln!(text, "</{open}>").unwrap();
                }
                open = array.section;
                let roles = if open == "PointData" { data } else { "" };
                writeln!(text, "<{open}{roles}>").unwrap();
            }
            let Array { kind, name, components, values, .. } = array;
            let bytes: Vec<u8> =
                values.iter().flat_map(|value| number(kind, *value, self.is_big_endian)).collect();
            write!(text, "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\"")
                .unwrap();
            match self.mode {
                Mode::Ascii => {
                    let words: Vec<String> = values.iter().map(f64::to_string).collect();
                    write!(text, " format=\"ascii\">\n  {}\n", words.join(" ")).unwrap();
                }
                Mode::Inline => {
                    let own = String::from_utf8(self.encoded(&bytes)).unwrap();
                    write!(text, " format=\"binary\">\n  {own}\n").unwrap();
                }
                Mode::Raw | Mode::Base64 => {
                    writeln!(text, " format=\"appended\" offset=\"{}\">", appended.len()).unwrap();
                    appended.extend(self.encoded(&bytes));
                }
            }
            // What VTK adds about some arrays.
            text += "<InformationKey name=\"L2\" location=\"vtkDataArray\" length=\"1\">\n\
                     <Value index=\"0\">\n7\n</Value>\n</InformationKey>\n</DataArray>\n";
        }
        let end = if open.is_empty() { String::new() } else { format!("</{open}>\n") };
        write!(text, "{end}</Piece>\n</{kind}>\n").unwrap();
        let mut file = text.into_bytes();
        if matches!(self.mode, Mode::Raw | Mode::Base64) {
            let encoding = if self.mode == Mode::Raw { "raw" } else { "base64" };
            file.extend(format!("<AppendedData encoding=\"{encoding}\">\n   _").into_bytes());
            file.extend(appended);
            file.extend(b"\n</AppendedData>\n");
        }
        file.extend(b"</VTKFile>\n");
        file
    }
}

/// Numbers as VTK's older format has them: words, or bytes with the highest first.
pub fn legacy_numbers(kind: &str, values: &[f64], is_binary: bool) -> Vec<u8> {
    if is_binary {
        let name = match kind {
            "float" => "Float32",
            "double" => "Float64",
            "int" => "Int32",
            "vtktypeint64" => "Int64",
            "unsigned_char" => "UInt8",
            other => panic!("no type {other}"),
        };
        return values.iter().flat_map(|value| number(name, *value, true)).chain(*b"\n").collect();
    }
    let words: Vec<String> = values.iter().map(f64::to_string).collect();
    format!("{}\n", words.join(" ")).into_bytes()
}
