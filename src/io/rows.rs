//! Long lists of rows, made by all threads and written in their order.

use std::io;
use std::io::Write;

use crate::mesh::chunks::par_map_chunks;

/// Rows that are in memory at the same time.
const ROWS: usize = 1 << 18;

/// Writes `count` rows, each as the bytes that `append` adds.
pub(crate) fn write_rows(
    file: &mut dyn Write,
    count: usize,
    append: impl Fn(&mut Vec<u8>, usize) + Sync,
) -> io::Result<()> {
    for begin in (0..count).step_by(ROWS) {
        let parts = par_map_chunks(ROWS.min(count - begin), |range| {
            let mut rows = Vec::new();
            range.for_each(|row| append(&mut rows, begin + row));
            rows
        });
        parts.iter().try_for_each(|rows| file.write_all(rows))?;
    }
    Ok(())
}
