// Undoing the moves of a triangle's corners. Include after polish/moved.glsl and declaring undone and
// counters.
#ifndef POLISH_UNDO_GLSL
#define POLISH_UNDO_GLSL

void undo_corners(uint t, uint pass) {
    uint k = 0u;
    do {
        uint v = corners[3u * t + k];
        // Who is first puts it into the list. The list's order differs from run to run, its content does not.
        if (atomicMin(stamps[v], pass) == STANDS) undone[atomicAdd(counters[0], 1u)] = v;
    } while (++k < 3u);
}

#endif
