//! Reads what an OBJ file has besides positions and faces: colours, texture coordinates, normals, materials,
//! groups.

use std::collections::HashMap;

use crate::TriMesh;
use crate::grammar::counted;
use crate::io::polygons::Fans;
use crate::mesh::attributes::{Attribute, Attributes, CornerUv, Kind, Role};

/// Keywords of lines that give all faces after them a label, with the names of the attributes.
pub(crate) const LABELS: [(&str, &str); 3] = [("usemtl", "material"), ("g", "group"), ("o", "object")];

/// The labels of one attribute.
#[derive(Default)]
struct Labels {
    names: Vec<String>,
    numbers: HashMap<String, u32>,
    /// The label of the faces to come.
    current: Option<u32>,
    /// The first triangle of each run with the same label, and that label: a number for each triangle would
    /// take more memory than the file.
    runs: Vec<(usize, u32)>,
}

impl Labels {
    fn index_of(&mut self, name: &str) -> u32 {
        let names = &mut self.names;
        *self.numbers.entry(name.to_owned()).or_insert_with(|| {
            names.push(name.to_owned());
            names.len() as u32 - 1
        })
    }

    /// Labels a face whose first triangle has the number `triangle`.
    fn label(&mut self, triangle: usize) {
        let current = self.current.unwrap_or_else(|| self.index_of(""));
        self.current = Some(current);
        if self.runs.last().is_none_or(|(_, label)| *label != current) {
            self.runs.push((triangle, current));
        }
    }

    /// The label of each triangle.
    fn values(&self, triangles: usize) -> Vec<f64> {
        let ends = self.runs.iter().skip(1).map(|(first, _)| *first).chain([triangles]);
        let runs = self.runs.iter().zip(ends);
        runs.flat_map(|((first, label), end)| std::iter::repeat_n(f64::from(*label), end - first)).collect()
    }
}

/// An index for each corner, from 1, 0 for none; it takes no memory until one is not 0.
#[derive(Default)]
struct CornerIndices(Vec<u32>);

impl CornerIndices {
    /// Adds the index of the corner with the number `corner`.
    fn push(&mut self, corner: usize, index: u32) {
        if index > 0 || !self.0.is_empty() {
            self.0.resize(corner, 0);
            self.0.push(index);
        }
    }
}

/// The attributes read so far.
#[derive(Default)]
pub(crate) struct AttributeReader {
    /// Red, green, blue and opacity of each vertex as long as all have a colour.
    colours: Vec<[f64; 4]>,
    /// The fewest components of a colour that a vertex has.
    colour_components: Option<usize>,
    any_colour: bool,
    uvs: Vec<[f64; 2]>,
    normals: Vec<[f64; 3]>,
    labels: [Labels; 3],
    libraries: Vec<String>,
    /// Vertices, texture coordinates and normals of the corners of all triangles.
    corners: Vec<u32>,
    corner_uvs: CornerIndices,
    corner_normals: CornerIndices,
    /// Vertex, texture coordinates and normal of the current face's corners, from 1; 0 for none.
    face: Vec<[u32; 3]>,
}

fn parse_or_nan(word: Option<&str>) -> f64 {
    word.and_then(|word| word.parse().ok()).unwrap_or(f64::NAN)
}

impl AttributeReader {
    /// Reads what follows the coordinates of a vertex.
    pub(crate) fn read_vertex<'a>(&mut self, words: impl Iterator<Item = &'a str>) {
        let mut colour = [1.0; 4];
        let mut count = 0;
        for (value, word) in colour.iter_mut().zip(words) {
            *value = parse_or_nan(Some(word));
            count += usize::from(value.is_finite());
        }
        // A single number is a weight.
        let count = if count < 3 { 0 } else { count };
        self.any_colour |= count > 0;
        let least = self.colour_components.map_or(count, |least| least.min(count));
        self.colour_components = Some(least);
        if least > 0 {
            self.colours.push(colour);
        } else {
            self.colours = Vec::new();
        }
    }

    /// Reads any other line; false if its keyword is unknown.
    pub(crate) fn read_line<'a>(&mut self, keyword: &str, mut words: impl Iterator<Item = &'a str>) -> bool {
        match keyword {
            "vt" => {
                let u = parse_or_nan(words.next());
                // A single number is a one-dimensional texture coordinate.
                let v = words.next().map_or(0.0, |word| parse_or_nan(Some(word)));
                self.uvs.push([u, v]);
            }
            "vn" => self.normals.push([0; 3].map(|_| parse_or_nan(words.next()))),
            "mtllib" => self.libraries.push(words.collect::<Vec<_>>().join(" ")),
            _ => {
                let kinds = LABELS.iter().zip(&mut self.labels);
                let Some((_, labels)) = kinds.into_iter().find(|((word, _), _)| *word == keyword) else {
                    return false;
                };
                labels.current = Some(labels.index_of(&words.collect::<Vec<_>>().join(" ")));
            }
        }
        true
    }

    /// Adds a corner of the current face; `word` has the indices of its vertex, texture coordinates and
    /// normal.
    pub(crate) fn add_corner(&mut self, vertex: u64, word: &str) {
        let mut parts = word.split('/').skip(1);
        let mut index = |count: usize| {
            let index = parts.next().and_then(|part| part.parse::<i64>().ok()).unwrap_or(0);
            let back = (count as u64 + 1).saturating_sub(index.unsigned_abs());
            u64::try_from(index).unwrap_or(back)
        };
        // Beyond 32 bits there is nothing: files with so much are refused.
        let corner = [vertex, index(self.uvs.len()), index(self.normals.len())];
        let corner = corner.map(|number| u32::try_from(number).unwrap_or(u32::MAX));
        self.face.push(corner);
    }

    /// Splits the current face into triangles and labels them.
    pub(crate) fn end_face(&mut self) {
        let triangle = self.corners.len() / 3;
        self.labels.iter_mut().for_each(|labels| labels.label(triangle));
        for [vertex, uv, normal] in Fans::triangles(&self.face).flatten() {
            self.corner_uvs.push(self.corners.len(), uv);
            self.corner_normals.push(self.corners.len(), normal);
            self.corners.push(vertex);
        }
        self.face.clear();
    }

    /// Leaves out the current face.
    pub(crate) fn skip_face(&mut self) {
        self.face.clear();
    }

    /// The attributes of `mesh`, which consists of the same triangles.
    pub(crate) fn into_attributes(self, mesh: &TriMesh, notes: &mut Vec<String>) -> Attributes {
        let of_corner = mesh.triangles.as_flattened();
        if of_corner.len() != self.corners.len() {
            return Attributes::default();
        }
        let mut file_numbers = vec![0; mesh.vertices.len()];
        for (vertex, corner) in of_corner.iter().zip(&self.corners) {
            if let Some(number) = file_numbers.get_mut(*vertex as usize) {
                *number = *corner;
            }
        }
        // Of points, all are there.
        if mesh.triangles.is_empty() {
            file_numbers = (1..=mesh.vertices.len() as u32).collect();
        }
        let mut vertex = Vec::new();
        vertex.extend(self.colour(&file_numbers, notes));
        vertex.extend(self.normal(mesh, notes));
        let mut face = Vec::new();
        let uv = self.uv(notes);
        for ((word, name), labels) in LABELS.into_iter().zip(self.labels) {
            // A single group of all faces is no information.
            let is_informative = labels.names.len() > 1
                || (word == "usemtl" && labels.names.first().is_some_and(|name| !name.is_empty()));
            if is_informative {
                let values = labels.values(mesh.triangles.len());
                let names = labels.names;
                face.push(Attribute { names, ..Attribute::new(name, Role::Label, Kind::U32, 1, values) });
            }
        }
        Attributes { vertex, face, uv, libraries: self.libraries, ..Attributes::default() }
    }

    /// `file_numbers` are the vertices' numbers in the file, from 1.
    fn colour(&self, file_numbers: &[u32], notes: &mut Vec<String>) -> Option<Attribute> {
        let components = self.colour_components.unwrap_or(0);
        if components < 3 {
            if self.any_colour {
                notes.push("colours were ignored: not all vertices have one".to_owned());
            }
            return None;
        }
        let of = |number: &u32| self.colours.get((*number as usize).wrapping_sub(1));
        let numbers =
            file_numbers.iter().flat_map(|number| of(number).into_iter().flatten().take(components));
        let values: Vec<f64> = numbers.copied().collect();
        // Some programs write 0 to 255 in place of 0 to 1.
        let is_of_bytes = values.iter().any(|x| *x > 1.0) && values.iter().all(|x| Kind::U8.holds(*x));
        let kind = if is_of_bytes { Kind::U8 } else { Kind::F64 };
        Some(Attribute::new("colour", Role::Colour, kind, components, values))
    }

    fn uv(&self, notes: &mut Vec<String>) -> Option<CornerUv> {
        let CornerIndices(corners) = &self.corner_uvs;
        if corners.is_empty() {
            return None;
        }
        let of = |corner: &u32| {
            self.uvs.get((*corner as usize).wrapping_sub(1)).filter(|uv| uv.iter().all(|x| x.is_finite()))
        };
        let values: Option<Vec<[f64; 2]>> = corners.iter().map(|corner| of(corner).copied()).collect();
        if values.is_none() {
            notes.push("texture coordinates were ignored: not all corners have them".to_owned());
        }
        values.map(|values| CornerUv { kind: Kind::F64, values })
    }

    fn normal(&self, mesh: &TriMesh, notes: &mut Vec<String>) -> Option<Attribute> {
        let CornerIndices(corners) = &self.corner_normals;
        // In MeshLab's files of points, each has its normal.
        if mesh.triangles.is_empty() && self.normals.len() == mesh.vertices.len() {
            return Some(Attribute::new(
                "normal",
                Role::Normal,
                Kind::F64,
                3,
                self.normals.as_flattened().to_vec(),
            ));
        }
        if corners.is_empty() {
            return None;
        }
        let of = |corner: &u32| {
            self.normals.get((*corner as usize).wrapping_sub(1)).filter(|n| n.iter().all(|x| x.is_finite()))
        };
        let mut sums = vec![([0.0; 3], None, false); mesh.vertices.len()];
        for (vertex, corner) in mesh.triangles.as_flattened().iter().zip(corners) {
            let Some(normal) = of(corner) else {
                notes.push("normals were ignored: not all corners have one".to_owned());
                return None;
            };
            if let Some((sum, first, differs)) = sums.get_mut(*vertex as usize) {
                sum.iter_mut().zip(normal).for_each(|(sum, value)| *sum += value);
                *differs |= *first.get_or_insert(*normal) != *normal;
            }
        }
        let differ = sums.iter().filter(|(_, _, differs)| *differs).count();
        if differ > 0 {
            let vertices = counted(differ, ["vertex has", "vertices have"]);
            notes.push(format!("{vertices} several normals, which were averaged"));
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
