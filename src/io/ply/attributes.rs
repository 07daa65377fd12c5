//! Reads properties other than positions and corners, and makes attributes of them.

use super::data::{Fault, Reading, Source};
use super::header::{Element, Values};
use super::write::type_name;
use crate::TriMesh;
use crate::grammar::counted;
use crate::io::checks::excerpt;
use crate::mesh::attributes::{Attribute, Attributes, CornerUv, Kind, Role, are_numbers_of_triangles};

/// Names of properties that make up one attribute.
const COLOUR: [&str; 4] = ["red", "green", "blue", "alpha"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
const TEXTURE: [[&str; 2]; 3] = [["s", "t"], ["u", "v"], ["texture_u", "texture_v"]];

/// Other names of colours and normals, in their order.
const OTHER_NAMES: [([&str; 3], [&str; 3]); 3] = [
    (["diffuse_red", "diffuse_green", "diffuse_blue"], ["red", "green", "blue"]),
    (["r", "g", "b"], ["red", "green", "blue"]),
    (["normal_x", "normal_y", "normal_z"], ["nx", "ny", "nz"]),
];

/// The usual name of a property, where an element has all three with other names that mean the same.
fn usual_name<'a>(element: &Element, name: &'a str) -> &'a str {
    let has = |name: &str| element.properties.iter().any(|property| property.name == name);
    let known = OTHER_NAMES.iter().find_map(|(names, usual)| {
        let at = names.iter().position(|own| *own == name)?;
        let fits = names.iter().all(|own| has(own)) && !usual.iter().any(|own| has(own));
        fits.then_some(usual[at])
    });
    known.unwrap_or(name)
}

/// The values of one scalar property.
struct Column {
    /// Its index among the element's properties.
    property: usize,
    name: String,
    kind: Kind,
    values: Vec<f64>,
    /// The first value that is not of the declared type.
    invalid: Option<String>,
}

/// The scalar properties of an element that become attributes.
#[derive(Default)]
pub(crate) struct Columns {
    columns: Vec<Column>,
}

impl Columns {
    /// All scalar properties except those with these indices.
    pub(crate) fn new(element: &Element, excluded: &[usize]) -> Self {
        let column = |(at, property): (usize, &super::header::Property)| match property.values {
            Values::Scalar(kind) if !excluded.contains(&at) => {
                let name = usual_name(element, &property.name).to_owned();
                Some(Column { property: at, name, kind, values: Vec::new(), invalid: None })
            }
            _ => None,
        };
        Self { columns: element.properties.iter().enumerate().filter_map(column).collect() }
    }

    /// Reads the value of the property with this index, if it is one of these columns; false if not.
    pub(crate) fn read<S: Source>(&mut self, at: usize, source: &mut S) -> Reading<bool> {
        // Sorted; binary search, because a malicious header may declare very many.
        let found = self.columns.binary_search_by_key(&at, |column| column.property);
        let Some(column) = found.ok().and_then(|index| self.columns.get_mut(index)) else { return Ok(false) };
        let kind = column.kind;
        let value = match source.value(column.kind) {
            Ok(value) if kind.holds(value) => value,
            Ok(value) => {
                column.invalid.get_or_insert(value.to_string());
                0.0
            }
            Err(Fault::NotANumber(word)) => {
                column.invalid.get_or_insert(word);
                0.0
            }
            Err(other) => return Err(other),
        };
        column.values.push(value);
        Ok(true)
    }

    /// Makes `copies` of the values read last: one for each triangle of a face, and none for one that is left
    /// out.
    pub(crate) fn repeat_last(&mut self, copies: usize) {
        for column in &mut self.columns {
            let last = column.values.last().copied().unwrap_or(0.0);
            column.values.resize((column.values.len() + copies).saturating_sub(1), last);
        }
    }

    /// The columns whose values are all of the declared type; the others are noted.
    fn valid_columns(self, element: &str, notes: &mut Vec<String>) -> Vec<Column> {
        let (valid, invalid): (Vec<Column>, Vec<Column>) =
            self.columns.into_iter().partition(|column| column.invalid.is_none());
        for Column { name, invalid, kind, .. } in invalid {
            let word = invalid.unwrap_or_default();
            notes.push(format!(
                "the property '{}' of each {element} was ignored: '{word}' is not of type {}",
                excerpt(&name),
                type_name(kind)
            ));
        }
        valid
    }
}

/// Removes the columns with these names and returns them, if all exist and have the same type.
fn take_columns(columns: &mut Vec<Column>, names: &[&str]) -> Option<(Kind, Vec<Column>)> {
    let place = |name: &&str| columns.iter().position(|column| column.name == **name);
    let places: Vec<usize> = names.iter().map(place).collect::<Option<_>>()?;
    let kinds: Vec<Kind> = places.iter().filter_map(|at| columns.get(*at)).map(|c| c.kind).collect();
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

/// One attribute with a component for each column.
fn join_columns(name: &str, role: Role, kind: Kind, columns: &[Column]) -> Attribute {
    let length = columns.first().map_or(0, |column| column.values.len());
    let value = |(index, column): (usize, &Column)| column.values.get(index).copied().unwrap_or(0.0);
    let values = (0..length).flat_map(|index| columns.iter().map(move |column| (index, column)));
    Attribute::new(name, role, kind, columns.len(), values.map(value).collect())
}

/// One attribute for the colour, one for the normal, and one for each remaining column.
fn join_attributes(mut columns: Vec<Column>, role: impl Fn(&Column) -> Role) -> Vec<Attribute> {
    let mut found = Vec::new();
    let colour = take_columns(&mut columns, &COLOUR).or_else(|| take_columns(&mut columns, &COLOUR[..3]));
    found.extend(colour.map(|(kind, colour)| join_columns("colour", Role::Colour, kind, &colour)));
    let normal = take_columns(&mut columns, &NORMAL);
    found.extend(normal.map(|(kind, normal)| join_columns("normal", Role::Normal, kind, &normal)));
    found.extend(columns.into_iter().map(|column| {
        let role = role(&column);
        Attribute::new(&column.name, role, column.kind, 1, column.values)
    }));
    found
}

/// Texture coordinates that faces have as lists, two numbers for each corner.
#[derive(Default)]
pub(crate) struct UvLists {
    /// The list of the current face.
    pub(crate) current_face: Vec<f64>,
    /// For the corners of all triangles so far.
    corners: Vec<[f64; 2]>,
    /// Faces whose list does not fit their corners.
    incomplete: u64,
}

impl UvLists {
    /// Splits the list of the current face, which has this many corners, in the same way as the face.
    pub(crate) fn end_face(&mut self, corners: usize) {
        let pairs = self.current_face.as_chunks::<2>().0;
        let is_complete = pairs.len() == corners && self.current_face.len() == 2 * corners;
        self.incomplete += u64::from(!is_complete && corners > 2);
        let at = |k: usize| pairs.get(k).copied().filter(|_| is_complete).unwrap_or_default();
        let fan = (1..corners.saturating_sub(1)).flat_map(|k| [at(0), at(k), at(k + 1)]);
        self.corners.extend(fan);
    }
}

/// The attributes of `mesh`; `uv` has the type of the lists of texture coordinates, if the file has them.
pub(crate) fn build_attributes(
    mesh: &TriMesh,
    (vertex, face): (Columns, Columns),
    uv: Option<(Kind, UvLists)>,
    notes: &mut Vec<String>,
) -> Attributes {
    let mut vertex = vertex.valid_columns("vertex", notes);
    let face = face.valid_columns("face", notes);
    let texture = TEXTURE.iter().find_map(|names| take_columns(&mut vertex, names));
    let by_vertex = texture.map(|(kind, texture)| {
        let flat = join_columns("", Role::Other, kind, &texture);
        let of_corner = |v: &u32| [flat.at(*v as usize)[0], flat.at(*v as usize)[1]];
        let values = mesh.triangles.as_flattened().iter().map(of_corner).collect();
        CornerUv { kind: flat.kind, values }
    });
    let by_corner = uv.and_then(|(kind, lists)| {
        if lists.incomplete > 0 {
            let faces = counted(lists.incomplete, ["face lacks", "faces lack"]);
            notes.push(format!("texture coordinates were ignored: {faces} some"));
            return None;
        }
        Some(CornerUv { kind, values: lists.corners })
    });
    let face_role = |column: &Column| {
        let is_label = column.kind.range().is_some() && !are_numbers_of_triangles(&column.values);
        if is_label { Role::Label } else { Role::Other }
    };
    Attributes {
        vertex: join_attributes(vertex, |_| Role::Other),
        face: join_attributes(face, face_role),
        uv: by_corner.or(by_vertex),
        ..Attributes::default()
    }
}
