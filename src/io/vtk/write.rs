//! Writes meshes for VTK and ParaView: .vtp and .vtu with their numbers in base64, .vtk as binary poly data.
//! Positions have 64 bits, attributes their own types.

use std::borrow::Cow;
use std::collections::HashSet;
use std::io;
use std::io::Write;

use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderWriter;
use percent_encoding::{AsciiSet, CONTROLS, utf8_percent_encode};
use quick_xml::escape::escape;

use super::attributes::CORNER_UV;
use crate::TriMesh;
use crate::io::binary::append_le;
use crate::io::volumes::raw::Number;
use crate::mesh::attributes::{Attribute, Attributes, Kind, Role};

/// VTK's number of triangles among cells.
const TRIANGLE: f64 = 5.0;
/// The name that PyVista gives to texture coordinates.
const TEXTURE: &str = "Texture Coordinates";
/// What names in the older format cannot have as it is.
const UNUSUAL: &AsciiSet = &CONTROLS.add(b' ').add(b'"').add(b'%');

/// Numbers to write.
struct Column<'m> {
    name: Cow<'m, str>,
    number: Number,
    components: usize,
    /// All numbers, not only rows.
    count: usize,
    role: Option<Role>,
    value: Box<dyn Fn(usize) -> f64 + 'm>,
}

impl<'m> Column<'m> {
    fn new(name: &'m str, number: Number, count: usize, value: impl Fn(usize) -> f64 + 'm) -> Self {
        let (name, value) = (Cow::Borrowed(name), Box::new(value));
        Self { name, number, components: 1, count, role: None, value }
    }

    fn bytes(&self) -> u64 {
        self.count as u64 * self.number.bytes() as u64
    }

    fn append(&self, bytes: &mut Vec<u8>, index: usize) {
        let value = (self.value)(index);
        match self.number {
            Number::Usual(kind) => append_le(bytes, kind, value),
            Number::I64 | Number::U64 | Number::F16 => bytes.extend((value as i64).to_le_bytes()),
        }
    }

    /// Writes all numbers, the lowest byte of each first or last.
    fn write(&self, file: &mut dyn Write, is_big_endian: bool) -> io::Result<()> {
        let mut bytes = Vec::new();
        for index in 0..self.count {
            let begin = bytes.len();
            self.append(&mut bytes, index);
            if is_big_endian {
                bytes[begin..].reverse();
            }
            if bytes.len() >= 1 << 16 {
                file.write_all(&bytes)?;
                bytes.clear();
            }
        }
        file.write_all(&bytes)
    }
}

/// The attribute in its own type; few programs know colours of 64 bits, which text formats give.
fn column(attribute: &Attribute) -> Column<'_> {
    let is_wide = attribute.role == Role::Colour && attribute.kind == Kind::F64;
    let kind = if is_wide { Kind::U8 } else { attribute.kind };
    let value = move |index: usize| {
        let value = attribute.values.get(index).copied().unwrap_or(0.0);
        if is_wide { kind.rounded(255.0 * value) } else { value }
    };
    let mut own = Column::new(&attribute.name, kind.into(), attribute.values.len(), value);
    own.components = attribute.components;
    own.role = Some(attribute.role);
    own
}

/// The arrays of points and of triangles, each under a name of its own.
struct Data<'m> {
    points: Vec<Column<'m>>,
    cells: Vec<Column<'m>>,
    /// Whether the last array of the points has the texture coordinates.
    has_texture: bool,
}

impl<'m> Data<'m> {
    fn new(mesh: &TriMesh, attributes: &'m Attributes) -> Self {
        let mut points: Vec<Column> = attributes.vertex.iter().map(column).collect();
        let mut cells: Vec<Column> = attributes.face.iter().map(column).collect();
        let mut has_texture = false;
        if let Some(uv) = &attributes.uv {
            let number = uv.kind.into();
            let mut own = match uv.by_vertex(mesh) {
                Some(values) => {
                    has_texture = true;
                    let count = 2 * values.len();
                    Column::new(TEXTURE, number, count, move |index| values[index / 2][index % 2])
                }
                None => {
                    let values = &uv.values;
                    Column::new(CORNER_UV, number, 2 * values.len(), |index| values[index / 2][index % 2])
                }
            };
            own.components = if has_texture { 2 } else { 6 };
            if has_texture { &mut points } else { &mut cells }.push(own);
        }
        for columns in [&mut points, &mut cells] {
            let mut names = HashSet::new();
            // Texture coordinates, at the end, are known by their names.
            for column in columns.iter_mut().rev() {
                while !names.insert(column.name.clone()) {
                    column.name.to_mut().push('_');
                }
            }
        }
        Self { points, cells, has_texture }
    }
}

/// The name of a type in XML.
fn xml_name(number: Number) -> &'static str {
    match number {
        Number::Usual(Kind::I8) => "Int8",
        Number::Usual(Kind::U8) => "UInt8",
        Number::Usual(Kind::I16) => "Int16",
        Number::Usual(Kind::U16) => "UInt16",
        Number::Usual(Kind::I32) => "Int32",
        Number::Usual(Kind::U32) => "UInt32",
        Number::Usual(Kind::F32) => "Float32",
        Number::Usual(Kind::F64) => "Float64",
        Number::I64 | Number::U64 | Number::F16 => "Int64",
    }
}

/// The name of a type in the older format.
fn legacy_name(number: Number) -> &'static str {
    match number {
        Number::Usual(Kind::I8) => "char",
        Number::Usual(Kind::U8) => "unsigned_char",
        Number::Usual(Kind::I16) => "short",
        Number::Usual(Kind::U16) => "unsigned_short",
        Number::Usual(Kind::I32) => "int",
        Number::Usual(Kind::U32) => "unsigned_int",
        Number::Usual(Kind::F32) => "float",
        Number::Usual(Kind::F64) => "double",
        Number::I64 | Number::U64 | Number::F16 => "vtktypeint64",
    }
}

fn positions(mesh: &TriMesh) -> Column<'_> {
    let mut own = Column::new("Points", Kind::F64.into(), 3 * mesh.vertices.len(), |index| {
        mesh.vertices[index / 3].to_array()[index % 3]
    });
    own.components = 3;
    own
}

/// Writes an element of this name with arrays, whose numbers are base64: `meshio` misreads plain bytes.
fn write_section(file: &mut dyn Write, name: &str, attributes: &str, columns: &[Column]) -> io::Result<()> {
    writeln!(file, "      <{name}{attributes}>")?;
    for column in columns {
        write!(
            file,
            "        <DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" \
             format=\"binary\">\n          ",
            xml_name(column.number),
            escape(column.name.as_ref()),
            column.components
        )?;
        let mut text = EncoderWriter::new(&mut *file, &STANDARD);
        text.write_all(&column.bytes().to_le_bytes())?;
        column.write(&mut text, false)?;
        text.finish()?;
        drop(text);
        file.write_all(b"\n        </DataArray>\n")?;
    }
    writeln!(file, "      </{name}>")
}

/// The attributes of an element that say which arrays are which.
fn roles(columns: &[Column], has_texture: bool) -> String {
    let named = |key: &str, found: Option<&Column>| {
        found.map_or(String::new(), |column| format!(" {key}=\"{}\"", escape(column.name.as_ref())))
    };
    let is_normal = |column: &&Column| column.role == Some(Role::Normal) && column.components == 3;
    let is_number = |column: &&Column| column.role.is_some() && !is_normal(column);
    named("Scalars", columns.iter().find(is_number))
        + &named("Normals", columns.iter().find(is_normal))
        + &named("TCoords", columns.last().filter(|_| has_texture))
}

/// Writes a .vtp file.
pub(crate) fn write_poly_data(
    file: &mut dyn Write,
    mesh: &TriMesh,
    attributes: &Attributes,
) -> io::Result<()> {
    let counts = format!(
        "NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" \
         NumberOfPolys=\"{}\"",
        mesh.vertices.len(),
        mesh.triangles.len()
    );
    write_xml(file, mesh, attributes, ["PolyData", "Polys", &counts], false)
}

/// Writes a .vtu file.
pub(crate) fn write_unstructured(
    file: &mut dyn Write,
    mesh: &TriMesh,
    attributes: &Attributes,
) -> io::Result<()> {
    let counts =
        format!("NumberOfPoints=\"{}\" NumberOfCells=\"{}\"", mesh.vertices.len(), mesh.triangles.len());
    write_xml(file, mesh, attributes, ["UnstructuredGrid", "Cells", &counts], true)
}

fn write_xml(
    file: &mut dyn Write,
    mesh: &TriMesh,
    attributes: &Attributes,
    [kind, list, counts]: [&str; 3],
    with_types: bool,
) -> io::Result<()> {
    let data = Data::new(mesh, attributes);
    let points = [positions(mesh)];
    let corners = mesh.triangles.as_flattened();
    let mut cells = vec![
        Column::new("connectivity", Number::I64, corners.len(), |index| corners[index].into()),
        Column::new("offsets", Number::I64, mesh.triangles.len(), |index| (3 * (index + 1)) as f64),
    ];
    if with_types {
        cells.push(Column::new("types", Kind::U8.into(), mesh.triangles.len(), |_| TRIANGLE));
    }
    write!(
        file,
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"UInt64\">\n  <{kind}>\n    <Piece {counts}>\n"
    )?;
    write_section(file, "PointData", &roles(&data.points, data.has_texture), &data.points)?;
    write_section(file, "CellData", &roles(&data.cells, false), &data.cells)?;
    write_section(file, "Points", "", &points)?;
    write_section(file, list, "", &cells)?;
    write!(file, "    </Piece>\n  </{kind}>\n</VTKFile>\n")
}

/// Writes a .vtk file.
pub(crate) fn write_legacy(file: &mut dyn Write, mesh: &TriMesh, attributes: &Attributes) -> io::Result<()> {
    let data = Data::new(mesh, attributes);
    let (vertices, triangles) = (mesh.vertices.len(), mesh.triangles.len());
    write!(
        file,
        "# vtk DataFile Version 4.2\nsurface mesh\nBINARY\nDATASET POLYDATA\nPOINTS {vertices} double\n"
    )?;
    positions(mesh).write(file, true)?;
    write!(file, "\nPOLYGONS {triangles} {}\n", 4 * triangles)?;
    let corners = Column::new("", Kind::I32.into(), 4 * triangles, |index| match index % 4 {
        0 => 3.0,
        corner => mesh.triangles[index / 4][corner - 1].into(),
    });
    corners.write(file, true)?;
    for (keyword, rows, columns) in [("POINT", vertices, &data.points), ("CELL", triangles, &data.cells)] {
        if columns.is_empty() {
            continue;
        }
        write!(file, "\n{keyword}_DATA {rows}")?;
        let has_texture = data.has_texture && keyword == "POINT";
        let normal = columns.iter().position(|c| c.role == Some(Role::Normal) && c.components == 3);
        let mut others = Vec::new();
        for (at, column) in columns.iter().enumerate() {
            let (name, kind) = (utf8_percent_encode(&column.name, UNUSUAL), legacy_name(column.number));
            if Some(at) == normal {
                write!(file, "\nNORMALS {name} {kind}\n")?;
            } else if has_texture && at + 1 == columns.len() {
                write!(file, "\nTEXTURE_COORDINATES {name} 2 {kind}\n")?;
            } else {
                others.push(column);
                continue;
            }
            column.write(file, true)?;
        }
        if !others.is_empty() {
            write!(file, "\nFIELD FieldData {}", others.len())?;
        }
        for column in others {
            let (name, kind) = (utf8_percent_encode(&column.name, UNUSUAL), legacy_name(column.number));
            write!(file, "\n{name} {} {rows} {kind}\n", column.components)?;
            column.write(file, true)?;
        }
    }
    file.write_all(b"\n")
}
