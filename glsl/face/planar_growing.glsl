// The restricted tangent face by intervals, from one line after another: only the lines that are edges so far
// are kept, in slots. Looking for the slot at hand instead of indexing it keeps the slots in registers. A
// line that is no edge of the face so far will never be one, so the order of the lines does not matter. The
// including file has declared the buffers sites and normals (packed). Constant 2 is taken here.
#ifndef COMMON_PLANAR_GROWING_GLSL
#define COMMON_PLANAR_GROWING_GLSL
#include "common/pins.glsl"
#include "common/planar_lines.glsl"
#include "common/sites.glsl"

// Most edges of a face while it is built. More are rare: face/planar_exact finds such faces without slots.
layout(constant_id = 2) const uint SLOTS = 12;

Line slots[SLOTS];
vec2 slot_left[SLOTS]; // what the others leave of the line; an empty slot has an empty interval
uint slot_site[SLOTS]; // the site behind it
float grown_bound; // no face reaches farther
float grown_radius_sq; // of the farthest corner, at most the squared bound
bool grown_full; // a line found no free slot, so the face is smaller than that of the slots

vec3 site_place, site_normal, site_u, site_v;
float site_mark;
uint site_index;

// Begins the face of a site: a disc.
void start_face(uint site, float bound) {
    site_index = site;
    vec4 own = site_at(site);
    site_place = own.xyz;
    site_mark = own.w;
    site_normal = unpack_normal(normals[site]);
    tangent_frame(site_normal, site_u, site_v);
    grown_bound = bound;
    grown_radius_sq = bound * bound;
    grown_full = false;
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) {
        slots[s] = Line(vec2(1.0, 0.0), NO_LINE);
        slot_left[s] = vec2(1.0, -1.0);
        slot_site[s] = NONE;
    }
}

bool is_slot_edge(uint s) { return slot_left[s].y > slot_left[s].x; }

// The part of the line of site j that the slots leave, which may be in one of them.
vec2 left_by_slots(uint j, Line line) {
    vec2 left = chord(line.offset, grown_bound);
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) {
        vec2 cut = cut_by(left, line, slots[s], j < slot_site[s]);
        left = is_slot_edge(s) && slot_site[s] != j ? cut : left;
    }
    return left;
}

// Whether site j is on the same sheet as the current site, and in its patch.
bool same_sheet(uint j) {
    float mark = site_at(j).w;
    bool agrees = dot(site_normal, unpack_normal(normals[j])) > TURNED_AWAY || counts_anywhere(mark);
    return agrees && same_patch(site_mark, mark);
}

Line line_of(uint j) { return bisector(site_at(j).xyz - site_place, site_u, site_v, true, j < site_index); }

bool has_slot(uint j) {
    bool found = false;
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) found = found || slot_site[s] == j;
    return found;
}

// Whether site j is near enough to cut a face that reaches no farther than the one so far.
bool is_near(uint j) {
    vec3 d = site_at(j).xyz - site_place;
    return dot(d, d) <= 4.0001 * grown_radius_sq;
}

// Cuts the face by the line of site j, if `valid`, it is on the same sheet, and there is a slot for it.
void cut_face(uint j, bool valid) {
    uint known = valid ? j : site_index;
    Line line = line_of(known);
    vec2 left = left_by_slots(known, line);
    bool cuts = valid && left.y > left.x && !has_slot(j) && same_sheet(known);
    vec2 cut[SLOTS];
    bool room = false;
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) {
        cut[s] = is_slot_edge(s) ? cut_by(slot_left[s], slots[s], line, slot_site[s] < j) : slot_left[s];
        room = room || !(cut[s].y > cut[s].x);
    }
    grown_full = grown_full || (cuts && !room);
    cuts = cuts && room;
    bool searching = cuts;
    float radius_sq = 0.0;
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) {
        slot_left[s] = cuts ? cut[s] : slot_left[s];
        bool here = searching && !is_slot_edge(s);
        slots[s].normal = here ? line.normal : slots[s].normal;
        slots[s].offset = here ? line.offset : slots[s].offset;
        slot_left[s] = here ? left : slot_left[s];
        slot_site[s] = here ? j : slot_site[s];
        searching = searching && !here;
        radius_sq = max(radius_sq, end_sq(slots[s], slot_left[s]));
    }
    grown_radius_sq = radius_sq > 0.0 ? min(radius_sq, grown_radius_sq) : grown_radius_sq;
}

// The sum of `below` over all edges.
vec3 sum_slots() {
    vec3 sum = vec3(0.0);
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) sum += below(slots[s], slot_left[s]);
    return sum;
}

bool is_open() { return grown_radius_sq >= OPEN * grown_bound * grown_bound; }

#endif
