//! A SPIR-V module as instructions.

/// Opcodes of the SPIR-V specification.
pub const OP_NAME: u32 = 5;
pub const OP_SPEC_CONSTANT: u32 = 50;
pub const OP_DECORATE: u32 = 71;

/// Source text, names, file names, lines and the compiler's settings.
const DEBUG: [u32; 9] = [2, 3, 4, OP_NAME, 6, 7, 8, 317, 330];

const HEADER_WORDS: usize = 5;

/// Opcodes with the words of their instructions, the opcode's own among them.
pub fn instructions(spirv: &[u32]) -> impl Iterator<Item = (u32, &[u32])> {
    let mut rest = spirv.get(HEADER_WORDS..).unwrap_or_default();
    std::iter::from_fn(move || {
        let head = *rest.first()?;
        let (instruction, tail) = rest.split_at_checked(((head >> 16) as usize).max(1))?;
        rest = tail;
        Some((head & 0xffff, instruction))
    })
}

/// The module as it is shipped: half the size, and no trace of where it was compiled.
pub fn without_debug_info(spirv: &[u32]) -> Vec<u32> {
    let kept = instructions(spirv).filter(|(op, _)| !DEBUG.contains(op)).flat_map(|(_, words)| words);
    spirv.iter().take(HEADER_WORDS).chain(kept).copied().collect()
}
