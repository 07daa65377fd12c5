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

vec3 slots[SLOTS]; // normal and offset of a line
vec2 slot_left[SLOTS]; // what the others leave of the line; an empty slot has an empty interval
uint slot_site[SLOTS]; // the site behind it
float grown_bound; // no face reaches farther
float grown_radius_sq; // of the farthest corner, at most the squared bound
bool grown_full; // a line found no free slot, so the face is smaller than that of the slots

vec3 site_place, site_normal, site_u, site_v;
float site_mark;
uint site_index;

void empty_slots() {
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) {
        slots[s] = vec3(1.0, 0.0, NO_LINE);
        slot_left[s] = vec2(1.0, -1.0);
        slot_site[s] = NONE;
    }
}

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
    empty_slots();
}

Line line_in(uint s) { return Line(slots[s].xy, slots[s].z); }

bool is_slot_edge(uint s) { return slot_left[s].y > slot_left[s].x; }

// The part of the line of site j that the slots leave, which may be in one of them.
vec2 left_by_slots(uint j, Line line) {
    vec2 left = chord(line.offset, grown_bound);
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) {
        vec2 cut = cut_by(left, line, line_in(s), j < slot_site[s]);
        left = mix(left, cut, bvec2(is_slot_edge(s) && slot_site[s] != j));
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

// Cuts the lines in the slots by that of site j, if `cuts`, and puts it into a free slot with the interval
// `left`, if `enters`. If there is none, the face is full, and nothing changes. Returns the squared distance
// of the farthest end of all that is left.
float take_line(uint j, Line line, vec2 left, bool cuts, bool enters) {
    vec2 cut[SLOTS];
    bool room = false;
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) {
        vec2 now = slot_left[s], then = cut_by(now, line_in(s), line, slot_site[s] < j);
        cut[s] = mix(now, then, bvec2(cuts && now.y > now.x && slot_site[s] != j));
        room = room || !(cut[s].y > cut[s].x);
    }
    grown_full = grown_full || (enters && !room);
    bool searching = enters && room, keeps = enters && !room;
    float farthest_sq = 0.0;
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) {
        vec2 now = mix(cut[s], slot_left[s], bvec2(keeps));
        bool here = searching && !(now.y > now.x);
        slots[s] = mix(slots[s], vec3(line.normal, line.offset), bvec3(here));
        slot_left[s] = mix(now, left, bvec2(here));
        slot_site[s] = mix(slot_site[s], j, here);
        searching = searching && !here;
        farthest_sq = max(farthest_sq, end_sq(line_in(s), slot_left[s]));
    }
    return farthest_sq;
}

// The face reaches no farther than its slots do.
void shrink_radius(float slots_sq) {
    grown_radius_sq = slots_sq > 0.0 ? min(slots_sq, grown_radius_sq) : grown_radius_sq;
}

// Cuts the face by the line of site j, if `valid`, it is on the same sheet, and there is a slot for it.
void cut_face(uint j, bool valid) {
    uint known = valid ? j : site_index;
    Line line = line_of(known);
    vec2 left = left_by_slots(known, line);
    bool cuts = valid && left.y > left.x && !has_slot(j) && same_sheet(known);
    shrink_radius(take_line(j, line, left, cuts, cuts));
}

// The last of the sites in the slots, -1 if there is none.
int last_slot_site() {
    int last = -1;
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) last = max(last, int(slot_site[s]));
    return last;
}

// The sum of `below` over all edges.
vec3 sum_slots() {
    vec3 sum = vec3(0.0);
    [[unroll]] for (uint s = 0u; s < SLOTS; ++s) sum += below(line_in(s), slot_left[s]);
    return sum;
}

bool is_open() { return grown_radius_sq >= OPEN * grown_bound * grown_bound; }

#endif
