//! Triangle strips, which some scanners' programs write in place of faces.

use super::data::{Fault, Source};
use super::header::{Element, Values};
use super::{element_error, is_corners, list_count, skip_property};
use crate::{Error, Result};

/// The triangles of strips of vertices below `vertices`; -1 ends a strip. Triangles with a vertex twice only
/// join parts of a strip.
///
/// # Errors
/// [`Error::Input`]: the strips have no list of vertices, a number is missing, or a vertex does not exist.
pub(super) fn read_strips<S: Source>(
    element: &Element,
    vertices: u64,
    source: &mut S,
) -> Result<Vec<[u32; 3]>> {
    if !element.properties.iter().any(|property| is_corners(&property.name)) {
        let problem = "the header declares no integer list 'vertex_indices' for triangle strips";
        return Err(Error::input(None, problem, "export the mesh again with vertex_indices"));
    }
    let mut triangles = Vec::new();
    for index in 0..element.count {
        let mut strip = Strip::default();
        let mut read = || {
            source.begin()?;
            for property in &element.properties {
                match property.values {
                    Values::List { count, item } if is_corners(&property.name) => {
                        for _ in 0..list_count(count, source)? {
                            let corner = source.value(item)?;
                            if corner.fract() != 0.0 || corner >= vertices as f64 || corner < -1.0 {
                                return Err(Fault::NotANumber(corner.to_string()));
                            }
                            triangles.extend(strip.add(corner));
                        }
                    }
                    values => skip_property(values, source)?,
                }
            }
            source.finish();
            Ok(())
        };
        read().map_err(|fault| match fault {
            Fault::NotANumber(corner) => {
                let place = Some(format!("{}, strip {index}", source.place()));
                let problem = format!("there is no vertex {corner}, indices go from 0 to {}", vertices - 1);
                Error::input(place, problem, "repair the strip, or export the mesh again")
            }
            fault => element_error(fault, element, index, source),
        })?;
    }
    Ok(triangles)
}

/// The vertices of a strip so far: the last two, and how many there were.
#[derive(Default)]
struct Strip {
    last: [u32; 2],
    length: usize,
}

impl Strip {
    /// The triangle that the next vertex completes; -1 starts another strip.
    fn add(&mut self, corner: f64) -> Option<[u32; 3]> {
        if corner < 0.0 {
            *self = Self::default();
            return None;
        }
        let (next, [first, second]) = (corner as u32, self.last);
        self.last = [second, next];
        self.length += 1;
        // Every other triangle of a strip turns the other way.
        let triangle = if self.length % 2 == 1 { [first, second, next] } else { [second, first, next] };
        let is_face = first != second && second != next && next != first;
        (self.length >= 3 && is_face).then_some(triangle)
    }
}
