// Sites in blocks of consecutive ones, with a buffer each for values of which one buffer could not hold all,
// or one dispatch not make all in a short time (see src/stages/blocks.rs). A dispatch is for one block; sites
// outside are only read, from what is not in blocks. The including file has the push constants first and
// block_sites.
#ifndef COMMON_BLOCKS_GLSL
#define COMMON_BLOCKS_GLSL

// The site of a thread, if it is in the block.
uint block_site(uint thread) { return first + thread; }

bool in_block(uint site) { return site - first < block_sites; }

// Where the buffer of the block has a value of a site.
uint block_place(uint slot, uint site) { return slot * block_sites + site - first; }

#endif
