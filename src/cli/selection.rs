//! Triangles that are kept as they are, on the command line.

use super::refine::labelled;
use rtfmesh::io::Loaded;
use rtfmesh::mesh::attributes::Attribute;
use rtfmesh::{Error, Result};

/// Which triangles `--keep` or `--only` names.
#[derive(Debug, Clone, PartialEq)]
pub enum Selection {
    /// Those of a label.
    Label(String),
    /// Those where an attribute of triangles, or of all their vertices, is not 0.
    Selected(String),
}

/// Reads `label:NAME` and `selection:NAME`.
pub fn selection(text: &str) -> std::result::Result<Selection, String> {
    match text.split_once(':') {
        Some(("label", name)) if !name.is_empty() => Ok(Selection::Label(name.to_owned())),
        Some(("selection", name)) if !name.is_empty() => Ok(Selection::Selected(name.to_owned())),
        _ => Err("give label:NAME or selection:NAME".to_owned()),
    }
}

/// The triangles that are kept: those of `keep`, or all but those of `only`; rising.
///
/// # Errors
/// [`Error::Usage`] for a label or an attribute that is not there, and for a selection of nothing.
pub fn kept(keep: &[Selection], only: &[Selection], loaded: &Loaded) -> Result<Vec<u32>> {
    let named = if keep.is_empty() { only } else { keep };
    let mut is_named = vec![false; loaded.mesh.triangles.len()];
    for selection in named {
        let triangles = match selection {
            Selection::Label(label) => labelled(label, loaded)?,
            Selection::Selected(name) => selected(name, loaded)?,
        };
        triangles.into_iter().for_each(|t| is_named[t as usize] = true);
    }
    if !only.is_empty() {
        is_named.iter_mut().for_each(|is| *is = !*is);
    }
    Ok((0..).zip(is_named).filter(|(_, is)| *is && !named.is_empty()).map(|(t, _)| t).collect())
}

/// The triangles that an attribute selects.
fn selected(name: &str, loaded: &Loaded) -> Result<Vec<u32>> {
    let Loaded { mesh, attributes, .. } = loaded;
    let own = |list: &'_ [Attribute]| list.iter().position(|own| own.name == name && own.components == 1);
    let is_set = |value: &f64| *value != 0.0;
    let found: Vec<u32> = if let Some(own) = own(&attributes.face) {
        let values = &attributes.face[own].values;
        (0..).zip(values).filter(|(_, value)| is_set(value)).map(|(t, _)| t).collect()
    } else if let Some(own) = own(&attributes.vertex) {
        let values = &attributes.vertex[own].values;
        let all = |corners: &[u32; 3]| corners.iter().all(|v| is_set(&values[*v as usize]));
        (0..).zip(&mesh.triangles).filter(|(_, corners)| all(corners)).map(|(t, _)| t).collect()
    } else {
        let all = attributes.face.iter().chain(&attributes.vertex).filter(|own| own.components == 1);
        let names: Vec<&str> = all.map(|own| own.name.as_str()).collect();
        let remedy = match names.is_empty() {
            true => "use a file whose triangles or vertices have one, such as PLY".to_owned(),
            false => format!("use one of these: {}", names.join(", ")),
        };
        let problem = format!("no numeric attribute of triangles or vertices is named '{name}'");
        return Err(Error::usage(problem, remedy));
    };
    if found.is_empty() {
        let problem = format!("the attribute '{name}' is 0 on all triangles");
        return Err(Error::usage(problem, "select some of them by another value"));
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rtfmesh::mesh::attributes::{Kind, Role};
    use rtfmesh::mesh::samples::sample;

    #[test]
    fn selections_are_read_and_looked_up() {
        assert_eq!(selection("label:a:b"), Ok(Selection::Label("a:b".to_owned())));
        let marked = selection("selection:marked").unwrap();
        for text in ["", "marked", "label:", "selection:", "box:1"] {
            assert!(selection(text).unwrap_err().contains("selection:NAME"), "{text}");
        }
        let mut loaded = Loaded { mesh: sample("box").unwrap(), ..Loaded::default() };
        let values = |count: usize| (0..count).map(|k| f64::from(u8::from(k < 5))).collect();
        let attribute = |count| Attribute::new("marked", Role::Other, Kind::U8, 1, values(count));
        let missing = kept(std::slice::from_ref(&marked), &[], &loaded).unwrap_err().to_string();
        assert!(missing.contains("'marked'"), "{missing}");
        loaded.attributes.vertex.push(attribute(8));
        let of_vertices = kept(std::slice::from_ref(&marked), &[], &loaded).unwrap();
        let all = |t: &u32| loaded.mesh.triangles[*t as usize].iter().all(|v| *v < 5);
        assert!(!of_vertices.is_empty() && of_vertices.iter().all(all));
        loaded.attributes.face.push(attribute(12));
        assert_eq!(kept(std::slice::from_ref(&marked), &[], &loaded).unwrap(), [0, 1, 2, 3, 4]);
        assert_eq!(kept(&[], std::slice::from_ref(&marked), &loaded).unwrap(), [5, 6, 7, 8, 9, 10, 11]);
        assert!(kept(&[], &[], &loaded).unwrap().is_empty());
    }
}
