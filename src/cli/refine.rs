//! Regions with edges of a given length, on the command line.

use super::target_count::length;
use rtfmesh::glam::DVec3;
use rtfmesh::io::Loaded;
use rtfmesh::mesh::attributes::{Attribute, Role};
use rtfmesh::{Error, Length, Refinement, Region, Size};

/// What `--refine` says.
#[derive(Debug, Clone, PartialEq)]
pub enum Wish {
    /// Known without a mesh.
    Place(Refinement),
    /// The triangles of a label.
    Label(String, Length),
}

/// Reads `sphere:X,Y,Z,R=LENGTH` and the like.
pub fn wish(text: &str) -> Result<Wish, String> {
    let unclear =
        || "give sphere:X,Y,Z,R=LENGTH, box:X0,Y0,Z0,X1,Y1,Z1=LENGTH or label:NAME=LENGTH".to_owned();
    let (region, size) = text.rsplit_once('=').ok_or_else(unclear)?;
    let length = match length(size)? {
        Size::RelativeEdgeLength(share) => Length::OfDiagonal(share),
        Size::EdgeLength(length) => Length::Units(length),
        _ => return Err(unclear()),
    };
    let (kind, what) = region.split_once(':').ok_or_else(unclear)?;
    let (Length::Units(value) | Length::OfDiagonal(value)) = length;
    if !(value > 0.0 && value.is_finite()) {
        return Err("give a length above 0".to_owned());
    }
    if kind == "label" && !what.is_empty() {
        return Ok(Wish::Label(what.to_owned(), length));
    }
    let numbers: Result<Vec<f64>, _> = what.split(',').map(|number| number.trim().parse()).collect();
    let numbers = numbers.map_err(|_| unclear())?;
    if numbers.iter().any(|number| !number.is_finite()) {
        return Err(unclear());
    }
    let region = match (kind, numbers.as_slice()) {
        ("sphere", &[x, y, z, radius]) => Region::Sphere { centre: DVec3::new(x, y, z), radius },
        ("box", &[x, y, z, u, v, w]) => {
            let ends = [DVec3::new(x, y, z), DVec3::new(u, v, w)];
            Region::Box { low: ends[0].min(ends[1]), high: ends[0].max(ends[1]) }
        }
        _ => return Err(unclear()),
    };
    Ok(Wish::Place(Refinement { region, length }))
}

/// What is known of these wishes without a mesh.
pub fn places(wishes: &[Wish]) -> Vec<Refinement> {
    let place = |wish: &Wish| match wish {
        Wish::Place(place) => Some(place.clone()),
        Wish::Label(..) => None,
    };
    wishes.iter().filter_map(place).collect()
}

/// All of them, for a mesh with these labels.
///
/// # Errors
/// [`Error::Usage`] for a label that it has not.
pub fn refinements(wishes: &[Wish], loaded: &Loaded) -> rtfmesh::Result<Vec<Refinement>> {
    let of = |wish: &Wish| match wish {
        Wish::Place(place) => Ok(place.clone()),
        Wish::Label(label, length) => {
            let triangles = labelled(label, loaded)?;
            let name = format!("label:{label}");
            Ok(Refinement { region: Region::Triangles { name, triangles }, length: *length })
        }
    };
    wishes.iter().map(of).collect()
}

/// The triangles with a label: a name that a label has, or its number, with or without the name of the
/// attribute and a colon before it.
///
/// # Errors
/// [`Error::Usage`] that names the labels that there are.
pub(super) fn labelled(label: &str, loaded: &Loaded) -> rtfmesh::Result<Vec<u32>> {
    let attributes = &loaded.attributes.face;
    let own = || attributes.iter().filter(|own| own.components == 1);
    let of = |own: &Attribute, label: &str| -> Vec<u32> {
        let is_it = |value: f64| name_of(own, value) == label || value.to_string() == label;
        (0..).zip(&own.values).filter(|(_, value)| is_it(**value)).map(|(t, _)| t).collect()
    };
    let mut found: Vec<u32> =
        own().filter(|own| own.role == Role::Label).flat_map(|own| of(own, label)).collect();
    if found.is_empty()
        && let Some((attribute, value)) = label.split_once(':')
    {
        found = own().filter(|own| own.name == attribute).flat_map(|own| of(own, value)).collect();
    }
    if !found.is_empty() {
        found.sort_unstable();
        found.dedup();
        return Ok(found);
    }
    let problem = format!("no triangle has the label '{label}'");
    let labels = all_labels(attributes);
    let remedy = match labels.len() {
        0 => "use a file whose triangles have labels, groups or materials".to_owned(),
        _ => format!("use one of these: {}", labels.join(", ")),
    };
    Err(Error::usage(problem, remedy))
}

/// The names of all labels, at most so many that a message can list them.
fn all_labels(attributes: &[Attribute]) -> Vec<String> {
    const MOST: usize = 20;
    let labels = attributes.iter().filter(|own| own.components == 1 && own.role == Role::Label);
    let mut names = Vec::new();
    for own in labels {
        let mut values = own.values.clone();
        values.sort_by(f64::total_cmp);
        values.dedup();
        names.extend(values.into_iter().take(MOST + 1).map(|value| name_of(own, value)));
    }
    if names.len() > MOST {
        names.truncate(MOST);
        names.push("...".to_owned());
    }
    names
}

/// The name of a label, or its number if it has none.
fn name_of(own: &Attribute, value: f64) -> String {
    let name = (value >= 0.0).then(|| own.names.get(value as usize)).flatten();
    name.filter(|name| !name.is_empty()).cloned().unwrap_or_else(|| value.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_are_read_and_others_refused() {
        let sphere = Region::Sphere { centre: DVec3::new(1.0, -2.0, 0.5), radius: 3.0 };
        let place = |region, length| Wish::Place(Refinement { region, length });
        assert_eq!(wish("sphere:1,-2, .5,3=0.1"), Ok(place(sphere, Length::Units(0.1))));
        let of_box = Region::Box { low: DVec3::ZERO, high: DVec3::new(1.0, 2.0, 3.0) };
        assert_eq!(wish("box:1,0,3,0,2,0=5%"), Ok(place(of_box, Length::OfDiagonal(0.05))));
        assert_eq!(wish("label:a=b=2"), Ok(Wish::Label("a=b".to_owned(), Length::Units(2.0))));
        for text in ["", "sphere:1,2,3=1", "box:1,2,3,4=1", "label:=1", "ball:1,2,3,4=1", "sphere:1,2,3,4"] {
            assert!(wish(text).unwrap_err().contains("sphere:X,Y,Z,R=LENGTH"), "{text}");
        }
        assert!(wish("sphere:1,2,3,4=far").unwrap_err().contains("give a length"));
        assert!(wish("label:a=-1").unwrap_err().contains("give a length"));
        assert!(wish("box:nan,0,0,1,1,1=0.1").unwrap_err().contains("box:X0"));
    }
}
