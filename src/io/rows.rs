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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_beyond_those_in_memory_are_written_in_their_order() {
        let count = ROWS + 4097;
        let mut file = Vec::new();
        write_rows(&mut file, count, |rows, row| rows.extend((row as u32).to_le_bytes())).unwrap();
        let wanted: Vec<u8> = (0..count as u32).flat_map(u32::to_le_bytes).collect();
        assert!(file == wanted, "{} bytes of {}", file.len(), wanted.len());
    }
}
