//! Numbers of points, column by column, as positions and attributes.

use glam::DVec3;

use crate::grammar::counted;
use crate::io::checks::excerpt;
use crate::io::loaded::Loaded;
use crate::mesh::attributes::{Attribute, Attributes, Kind, Role};
use crate::{Error, Result, TriMesh};

/// One number of every point.
pub(super) struct Column {
    pub name: String,
    pub kind: Kind,
    pub values: Vec<f64>,
}

/// Other names of columns, in small letters.
const SAME: [(&str, &str); 16] = [
    ("r", "red"),
    ("g", "green"),
    ("b", "blue"),
    ("a", "alpha"),
    ("normal_x", "nx"),
    ("normal_y", "ny"),
    ("normal_z", "nz"),
    ("x-coordinate", "x"),
    ("y-coordinate", "y"),
    ("z-coordinate", "z"),
    ("rf", "red"),
    ("gf", "green"),
    ("bf", "blue"),
    // ParaView's.
    ("points:0", "x"),
    ("points:1", "y"),
    ("points:2", "z"),
];

/// The name that stands for all that mean the same.
pub(super) fn usual_name(name: &str) -> String {
    let name = name.trim().trim_matches(['"', '\'', '/']).to_ascii_lowercase();
    SAME.iter().find(|(other, _)| *other == name).map_or(name, |(_, usual)| (*usual).to_owned())
}

/// Puts columns of equal lengths together: x, y and z, a normal, a colour, and others for themselves.
/// Points without a finite position are left out with a note.
///
/// # Errors
/// [`Error::Input`] without x, y and z, and without points.
pub(super) fn load_columns(mut columns: Vec<Column>, mut notes: Vec<String>) -> Result<Loaded> {
    let Some(position) = take(&mut columns, &["x", "y", "z"]) else {
        let problem = "there are no columns x, y and z";
        return Err(Error::input(None, problem, "name them, or leave all names out"));
    };
    let [x, y, z] = [0, 1, 2].map(|axis| &position[axis].values);
    let points: Vec<DVec3> = x.iter().zip(y).zip(z).map(|((x, y), z)| DVec3::new(*x, *y, *z)).collect();
    let missing = points.iter().filter(|p| !p.is_finite()).count();
    if missing == points.len() {
        let problem = if missing > 0 { "no point has a finite position" } else { "the file has no points" };
        return Err(Error::input(None, problem, "give a file with points"));
    }
    if missing > 0 {
        notes.push(without_position(missing));
        for column in &mut columns {
            let values = column.values.iter().zip(&points).filter(|(_, p)| p.is_finite());
            column.values = values.map(|(value, _)| *value).collect();
        }
    }
    let vertices = points.into_iter().filter(|p| p.is_finite()).collect();
    let attributes = Attributes { vertex: attributes(columns), ..Attributes::default() };
    Ok(Loaded { mesh: TriMesh { vertices, triangles: Vec::new() }, attributes, notes, ..Loaded::default() })
}

/// Takes the columns of these names out, if all are there.
fn take(columns: &mut Vec<Column>, names: &[&str]) -> Option<Vec<Column>> {
    let place = |columns: &[Column], name: &str| columns.iter().position(|column| column.name == name);
    names
        .iter()
        .all(|name| place(columns, name).is_some())
        .then(|| names.iter().filter_map(|name| place(columns, name).map(|at| columns.remove(at))).collect())
}

fn attributes(mut columns: Vec<Column>) -> Vec<Attribute> {
    let mut found = Vec::new();
    if let Some(colour) = take(&mut columns, &["red", "green", "blue"]) {
        let values = || colour.iter().flat_map(|column| &column.values);
        let kind = match colour[0].kind {
            _ if values().all(|value| Kind::U8.holds(*value)) => Kind::U8,
            Kind::U16 => Kind::U16,
            _ => Kind::F64,
        };
        // Other numbers than 0 to 255 or 0 to 1 are no colour that anybody knows.
        let is_colour = kind != Kind::F64 || values().all(|value| (0.0..=1.0).contains(value));
        let role = if is_colour { Role::Colour } else { Role::Other };
        found.push(join_columns("colour", role, kind, &colour));
    }
    if let Some(normal) = take(&mut columns, &["nx", "ny", "nz"]) {
        found.push(join_columns("normal", Role::Normal, Kind::F64, &normal));
    }
    let other =
        |column: Column| Attribute::new(&excerpt(&column.name), Role::Other, column.kind, 1, column.values);
    found.extend(columns.into_iter().map(other));
    found
}

fn join_columns(name: &str, role: Role, kind: Kind, columns: &[Column]) -> Attribute {
    let count = columns.first().map_or(0, |column| column.values.len());
    let values = (0..count).flat_map(|i| columns.iter().map(move |column| column.values[i])).collect();
    Attribute::new(name, role, kind, columns.len(), values)
}

/// A note on points that have no position.
pub(super) fn without_position(count: usize) -> String {
    let points = ["point without a position was", "points without a position were"];
    format!("{} left out", counted(count, points))
}
