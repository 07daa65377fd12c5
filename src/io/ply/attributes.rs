//! The properties of a PLY element that are no shape, and the attributes that they make.

use super::data::{Fault, Reading, Source};
use super::header::{Element, Kind, Type};
use crate::TriMesh;
use crate::io::excerpt;
use crate::mesh::attributes;
use crate::mesh::attributes::{Attribute, Attributes, CornerUv, Role};

/// Names that go together.
const COLOUR: [&str; 4] = ["red", "green", "blue", "alpha"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
const TEXTURE: [[&str; 2]; 3] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];

/// One number of each vertex or face.
struct Column {
    /// Its place among the element's properties.
    at: usize,
    name: String,
    kind: Type,
    values: Vec<f64>,
    /// The first word that is no number of its type.
    bad: Option<String>,
}

/// The numbers of an element that are no coordinates.
pub(crate) struct Columns {
    columns: Vec<Column>,
}

impl Columns {
    /// The scalar properties but those at these places.
    pub(crate) fn new(element: &Element, others: &[usize]) -> Self {
        let column = |(at, property): (usize, &super::header::Property)| match property.kind {
            Kind::Scalar(kind) if !others.contains(&at) => {
                let name = property.name.clone();
                Some(Column { at, name, kind, values: Vec::new(), bad: None })
            }
            _ => None,
        };
        Self { columns: element.properties.iter().enumerate().filter_map(column).collect() }
    }

    /// Reads the property at this place, if it is one of these; tells whether.
    pub(crate) fn read<S: Source>(&mut self, at: usize, source: &mut S) -> Reading<bool> {
        // In their order, of which a hostile header may declare very many.
        let place = self.columns.binary_search_by_key(&at, |column| column.at);
        let Some(column) = place.ok().and_then(|place| self.columns.get_mut(place)) else { return Ok(false) };
        let kind = column.kind.of_attribute();
        let value = match source.value(column.kind) {
            Ok(value) if kind.holds(value) => value,
            Ok(value) => {
                column.bad.get_or_insert(value.to_string());
                0.0
            }
            // As some programs spell what is no number.
            Err(Fault::NotANumber(word)) if kind.range().is_none() && is_nan(&word) => f64::NAN,
            Err(Fault::NotANumber(word)) => {
                column.bad.get_or_insert(word);
                0.0
            }
            Err(other) => return Err(other),
        };
        column.values.push(value);
        Ok(true)
    }

    /// Makes `copies` of what was read last: a face that became so many triangles.
    pub(crate) fn repeat(&mut self, copies: usize) {
        for column in &mut self.columns {
            let last = column.values.last().copied().unwrap_or(0.0);
            column.values.resize(column.values.len() + copies.saturating_sub(1), last);
        }
    }

    /// Drops what is not of its type, with a note.
    fn sound(self, element: &str, notes: &mut Vec<String>) -> Vec<Column> {
        let (sound, bad): (Vec<Column>, Vec<Column>) =
            self.columns.into_iter().partition(|column| column.bad.is_none());
        for Column { name, bad, kind, .. } in bad {
            let word = bad.unwrap_or_default();
            notes.push(format!(
                "the property '{}' of each {element} was ignored: '{word}' is no {}",
                excerpt(&name),
                kind.name()
            ));
        }
        sound
    }
}

fn is_nan(word: &str) -> bool {
    word.trim_start_matches(['+', '-']).get(..3).is_some_and(|start| start.eq_ignore_ascii_case("nan"))
}

/// Takes the columns of these names out, if all are there and of one type.
fn take(columns: &mut Vec<Column>, names: &[&str]) -> Option<(Type, Vec<Column>)> {
    let place = |name: &&str| columns.iter().position(|column| column.name == **name);
    let places: Vec<usize> = names.iter().map(place).collect::<Option<_>>()?;
    let kinds: Vec<Type> = places.iter().filter_map(|at| columns.get(*at)).map(|c| c.kind).collect();
    let kind = *kinds.first()?;
    if kinds.iter().any(|other| *other != kind) {
        return None;
    }
    let mut taken = Vec::new();
    for name in names {
        let at = columns.iter().position(|column| column.name == *name)?;
        taken.push(columns.remove(at));
    }
    Some((kind, taken))
}

fn joined(name: &str, role: Role, (kind, columns): (Type, Vec<Column>)) -> Attribute {
    let length = columns.first().map_or(0, |column| column.values.len());
    let value = |(index, column): (usize, &Column)| column.values.get(index).copied().unwrap_or(0.0);
    let values = (0..length).flat_map(|index| columns.iter().map(move |column| (index, column)));
    Attribute::new(name, role, kind.of_attribute(), columns.len(), values.map(value).collect())
}

/// The attributes that columns make, colours and normals put together.
fn attributes_of(mut columns: Vec<Column>, role: impl Fn(&Column) -> Role) -> Vec<Attribute> {
    let mut found = Vec::new();
    let colour = take(&mut columns, &COLOUR).or_else(|| take(&mut columns, &COLOUR[..3]));
    found.extend(colour.map(|colour| joined("colour", Role::Colour, colour)));
    found.extend(take(&mut columns, &NORMAL).map(|normal| joined("normal", Role::Normal, normal)));
    found.extend(columns.into_iter().map(|column| {
        let role = role(&column);
        Attribute::new(&column.name, role, column.kind.of_attribute(), 1, column.values)
    }));
    found
}

/// Texture coordinates in lists, two numbers for each corner of a face.
#[derive(Default)]
pub(crate) struct UvLists {
    /// Those of the face that is read.
    pub(crate) of_face: Vec<f64>,
    /// Those of the triangles so far.
    corners: Vec<[f64; 2]>,
    missing: u64,
}

impl UvLists {
    /// Splits the list of a face of so many corners as the face is.
    pub(crate) fn split(&mut self, corners: usize) {
        let pairs = self.of_face.as_chunks::<2>().0;
        let whole = pairs.len() == corners && self.of_face.len() == 2 * corners;
        self.missing += u64::from(!whole);
        let at = |k: usize| pairs.get(k).copied().filter(|_| whole).unwrap_or_default();
        let fan = (1..corners.saturating_sub(1)).flat_map(|k| [at(0), at(k), at(k + 1)]);
        self.corners.extend(fan);
    }
}

/// Puts together what was read beside the mesh; `uv` has the type of the lists, where there are any.
pub(crate) fn attributes(
    mesh: &TriMesh,
    (vertex, face): (Columns, Columns),
    uv: Option<(Type, UvLists)>,
    notes: &mut Vec<String>,
) -> Attributes {
    let mut vertex = vertex.sound("vertex", notes);
    let face = face.sound("face", notes);
    let texture = TEXTURE.iter().find_map(|names| take(&mut vertex, names));
    let by_vertex = texture.map(|texture| {
        let flat = joined("", Role::Other, texture);
        let of_corner = |v: &u32| [flat.at(*v as usize)[0], flat.at(*v as usize)[1]];
        let values = mesh.triangles.as_flattened().iter().map(of_corner).collect();
        CornerUv { kind: flat.kind, values }
    });
    let by_corner = uv.and_then(|(kind, lists)| {
        if lists.missing > 0 {
            let count = lists.missing;
            notes.push(format!("texture coordinates were ignored: {count} faces lack some"));
            return None;
        }
        Some(CornerUv { kind: kind.of_attribute(), values: lists.corners })
    });
    let of_face = |column: &Column| {
        if column.kind.of_attribute().range().is_some() { Role::Label } else { Role::Other }
    };
    Attributes {
        vertex: attributes_of(vertex, |_| Role::Other),
        face: attributes_of(face, of_face),
        uv: by_corner.or(by_vertex),
        libraries: Vec::new(),
        materials: None,
    }
}

impl Type {
    /// The same type of attributes.
    pub(crate) fn of_attribute(self) -> attributes::Kind {
        match self {
            Self::I8 => attributes::Kind::I8,
            Self::U8 => attributes::Kind::U8,
            Self::I16 => attributes::Kind::I16,
            Self::U16 => attributes::Kind::U16,
            Self::I32 => attributes::Kind::I32,
            Self::U32 => attributes::Kind::U32,
            Self::F32 => attributes::Kind::F32,
            Self::F64 => attributes::Kind::F64,
        }
    }

    /// Its usual name in headers.
    pub(crate) fn name(self) -> &'static str {
        super::write::type_name(self.of_attribute())
    }
}
