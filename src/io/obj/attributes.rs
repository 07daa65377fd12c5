//! What an OBJ file has beside vertices and faces: colours, texture coordinates, normals, materials, groups.

use std::collections::HashMap;
use std::io;
use std::io::Write;

use crate::TriMesh;
use crate::io::write::{write_number, write_obj_vertex};
use crate::mesh::attributes::{Attribute, Attributes, CornerUv, Kind, Role};

/// Kinds of lines that give all following faces a label, and the attributes' names.
const LABELS: [(&str, &str); 3] = [("usemtl", "material"), ("g", "group"), ("o", "object")];

/// Labels of one kind.
#[derive(Default)]
struct Labels {
    names: Vec<String>,
    known: HashMap<String, u32>,
    now: Option<u32>,
    of_triangles: Vec<f64>,
}

impl Labels {
    fn number(&mut self, name: &str) -> u32 {
        let names = &mut self.names;
        *self.known.entry(name.to_owned()).or_insert_with(|| {
            names.push(name.to_owned());
            names.len() as u32 - 1
        })
    }
}

/// What the scan of a file gathers.
#[derive(Default)]
pub(crate) struct Extras {
    /// Red, green, blue and opacity of each vertex, and how many of them the poorest vertex has.
    colours: Vec<[f64; 4]>,
    colour_components: Option<usize>,
    any_colour: bool,
    uvs: Vec<[f64; 2]>,
    normals: Vec<[f64; 3]>,
    labels: [Labels; 3],
    libraries: Vec<String>,
    /// Vertices, texture coordinates and normals of the corners of all triangles, from 1; 0 for none.
    corners: Vec<[u64; 3]>,
    face: Vec<[u64; 3]>,
}

fn number(word: Option<&str>) -> f64 {
    word.and_then(|word| word.parse().ok()).unwrap_or(f64::NAN)
}

impl Extras {
    /// What follows the coordinates of a vertex.
    pub(crate) fn vertex<'a>(&mut self, words: impl Iterator<Item = &'a str>) {
        let mut colour = [1.0; 4];
        let mut count = 0;
        for (value, word) in colour.iter_mut().zip(words) {
            *value = number(Some(word));
            count += usize::from(value.is_finite());
        }
        // One number alone is a weight.
        let count = if count < 3 { 0 } else { count };
        self.any_colour |= count > 0;
        self.colour_components = Some(self.colour_components.map_or(count, |least| least.min(count)));
        self.colours.push(colour);
    }

    /// A line of another kind; tells whether it is one of these.
    pub(crate) fn line<'a>(&mut self, keyword: &str, mut words: impl Iterator<Item = &'a str>) -> bool {
        match keyword {
            "vt" => {
                let u = number(words.next());
                // One number is a texture along a line.
                let v = words.next().map_or(0.0, |word| number(Some(word)));
                self.uvs.push([u, v]);
            }
            "vn" => self.normals.push([0; 3].map(|_| number(words.next()))),
            "mtllib" => self.libraries.push(words.collect::<Vec<_>>().join(" ")),
            _ => {
                let kinds = LABELS.iter().zip(&mut self.labels);
                let Some((_, labels)) = kinds.into_iter().find(|((word, _), _)| *word == keyword) else {
                    return false;
                };
                labels.now = Some(labels.number(&words.collect::<Vec<_>>().join(" ")));
            }
        }
        true
    }

    /// A corner of the face to come: its vertex, and the word that names all three.
    pub(crate) fn corner(&mut self, vertex: u64, word: &str) {
        let mut parts = word.split('/').skip(1);
        let mut index = |count: usize| {
            let index = parts.next().and_then(|part| part.parse::<i64>().ok()).unwrap_or(0);
            let back = (count as u64 + 1).saturating_sub(index.unsigned_abs());
            u64::try_from(index).unwrap_or(back)
        };
        let corner = [vertex, index(self.uvs.len()), index(self.normals.len())];
        self.face.push(corner);
    }

    /// The end of a face: its triangles.
    pub(crate) fn end_face(&mut self) {
        let triangles = self.face.len().saturating_sub(2);
        if let [first, others @ ..] = self.face.as_slice() {
            self.corners.extend(others.windows(2).flatten().enumerate().flat_map(|(k, corner)| {
                let first = k.is_multiple_of(2).then_some(*first);
                first.into_iter().chain([*corner])
            }));
        }
        for labels in &mut self.labels {
            let now = labels.now.unwrap_or_else(|| labels.number(""));
            labels.now = Some(now);
            labels.of_triangles.resize(labels.of_triangles.len() + triangles, f64::from(now));
        }
        self.face.clear();
    }

    /// The attributes of the mesh that was made of the same triangles.
    pub(crate) fn attributes(self, mesh: &TriMesh, notes: &mut Vec<String>) -> Attributes {
        let of_corner = mesh.triangles.as_flattened();
        if of_corner.len() != self.corners.len() {
            return Attributes::default();
        }
        let mut in_file = vec![0; mesh.vertices.len()];
        for (vertex, corner) in of_corner.iter().zip(&self.corners) {
            if let Some(number) = in_file.get_mut(*vertex as usize) {
                *number = corner[0];
            }
        }
        let mut vertex = Vec::new();
        vertex.extend(self.colour(&in_file, notes));
        vertex.extend(self.normal(mesh, notes));
        let mut face = Vec::new();
        let uv = self.uv(notes);
        for ((word, name), labels) in LABELS.into_iter().zip(self.labels) {
            // One group of everything says nothing.
            let says = labels.names.len() > 1 || (word == "usemtl" && labels.names != [""]);
            if says {
                let numbers = labels.of_triangles;
                let names = labels.names;
                face.push(Attribute { names, ..Attribute::new(name, Role::Label, Kind::U32, 1, numbers) });
            }
        }
        Attributes { vertex, face, uv, libraries: self.libraries, materials: None }
    }

    fn colour(&self, in_file: &[u64], notes: &mut Vec<String>) -> Option<Attribute> {
        let components = self.colour_components.unwrap_or(0);
        if components < 3 {
            if self.any_colour {
                notes.push("colours were ignored, for not all vertices have one".to_owned());
            }
            return None;
        }
        let of = |number: &u64| self.colours.get((*number as usize).wrapping_sub(1));
        let numbers = in_file.iter().flat_map(|number| of(number).into_iter().flatten().take(components));
        Some(Attribute::new("colour", Role::Colour, Kind::F64, components, numbers.copied().collect()))
    }

    fn uv(&self, notes: &mut Vec<String>) -> Option<CornerUv> {
        if self.corners.iter().all(|corner| corner[1] == 0) {
            return None;
        }
        let of = |corner: &[u64; 3]| {
            self.uvs.get((corner[1] as usize).wrapping_sub(1)).filter(|uv| uv.iter().all(|x| x.is_finite()))
        };
        let values: Option<Vec<[f64; 2]>> = self.corners.iter().map(|corner| of(corner).copied()).collect();
        if values.is_none() {
            notes.push("texture coordinates were ignored, for not all corners have them".to_owned());
        }
        values.map(|values| CornerUv { kind: Kind::F64, values })
    }

    fn normal(&self, mesh: &TriMesh, notes: &mut Vec<String>) -> Option<Attribute> {
        if self.corners.iter().all(|corner| corner[2] == 0) {
            return None;
        }
        let of = |corner: &[u64; 3]| {
            self.normals.get((corner[2] as usize).wrapping_sub(1)).filter(|n| n.iter().all(|x| x.is_finite()))
        };
        let mut sums = vec![([0.0; 3], None, false); mesh.vertices.len()];
        for (vertex, corner) in mesh.triangles.as_flattened().iter().zip(&self.corners) {
            let Some(normal) = of(corner) else {
                notes.push("normals were ignored, for not all corners have one".to_owned());
                return None;
            };
            if let Some((sum, first, differs)) = sums.get_mut(*vertex as usize) {
                sum.iter_mut().zip(normal).for_each(|(sum, value)| *sum += value);
                *differs |= *first.get_or_insert(*normal) != *normal;
            }
        }
        let differ = sums.iter().filter(|(_, _, differs)| *differs).count();
        if differ > 0 {
            notes.push(format!("{differ} vertices have several normals, of which the mean was taken"));
        }
        let values = sums.into_iter().flat_map(|(sum, first, differs)| {
            let length = sum.iter().map(|value| value * value).sum::<f64>().sqrt();
            match first {
                Some(_) if differs && length > 0.0 => sum.map(|value| value / length),
                Some(one) => one,
                None => [0.0; 3],
            }
        });
        Some(Attribute::new("normal", Role::Normal, Kind::F64, 3, values.collect()))
    }
}

/// Writes the lines of a vertex's coordinates and colour.
fn write_vertices(file: &mut dyn Write, mesh: &TriMesh, colour: Option<&Attribute>) -> io::Result<()> {
    let mut file = file;
    for (v, vertex) in mesh.vertices.iter().enumerate() {
        let Some(colour) = colour else {
            write_obj_vertex(&mut file, *vertex)?;
            continue;
        };
        write!(file, "v")?;
        let shades = colour.unit_colour(v);
        for value in vertex.to_array().iter().chain(shades.iter().take(colour.components)) {
            write!(file, " ")?;
            write_number(file, *value)?;
        }
        writeln!(file)?;
    }
    Ok(())
}

fn write_numbers(file: &mut dyn Write, keyword: &str, values: &[f64]) -> io::Result<()> {
    write!(file, "{keyword}")?;
    for value in values {
        write!(file, " ")?;
        write_number(file, *value)?;
    }
    writeln!(file)
}

/// Writes a mesh; colours go behind the coordinates, equal texture coordinates are written once.
pub(crate) fn write(file: &mut dyn Write, mesh: &TriMesh, attributes: &Attributes) -> io::Result<()> {
    for library in &attributes.libraries {
        writeln!(file, "mtllib {library}")?;
    }
    let colour = attributes.vertex_role(Role::Colour).filter(|colour| colour.components >= 3);
    let normal = attributes.vertex_role(Role::Normal).filter(|normal| normal.components == 3);
    write_vertices(file, mesh, colour)?;
    let mut numbers = HashMap::new();
    let mut of_corners = Vec::new();
    for uv in attributes.uv.iter().flat_map(|uv| &uv.values) {
        let next = numbers.len() + 1;
        let number = *numbers.entry(uv.map(f64::to_bits)).or_insert(next);
        if number == next {
            write_numbers(file, "vt", uv)?;
        }
        of_corners.push(number);
    }
    for v in 0..mesh.vertices.len() {
        if let Some(normal) = normal {
            write_numbers(file, "vn", normal.at(v))?;
        }
    }
    let mut now = [None; 3];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        for ((word, name), now) in LABELS.into_iter().zip(&mut now) {
            let Some(label) = attributes.face_named(name).filter(|label| label.components == 1) else {
                continue;
            };
            let number = label.at(t).first().map(|value| *value as usize);
            if *now != number {
                *now = number;
                let own = number.and_then(|number| label.names.get(number).cloned());
                let given = own.unwrap_or_else(|| format!("{name}{}", number.unwrap_or_default()));
                // No name is what begins before the first such line.
                writeln!(file, "{}", format!("{word} {given}").trim_end())?;
            }
        }
        write!(file, "f")?;
        for (k, vertex) in triangle.iter().enumerate() {
            let vertex = u64::from(*vertex) + 1;
            match (of_corners.get(3 * t + k), normal) {
                (Some(uv), Some(_)) => write!(file, " {vertex}/{uv}/{vertex}")?,
                (Some(uv), None) => write!(file, " {vertex}/{uv}")?,
                (None, Some(_)) => write!(file, " {vertex}//{vertex}")?,
                (None, None) => write!(file, " {vertex}")?,
            }
        }
        writeln!(file)?;
    }
    Ok(())
}
