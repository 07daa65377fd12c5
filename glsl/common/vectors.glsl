// Buffers of vectors that a kernel only reads. Where TEXELS is defined, they are texel buffers, which some
// devices read faster (see src/gpu/select.rs). They are read by AT, or AT2 if the vectors have two numbers.
#ifndef COMMON_VECTORS_GLSL
#define COMMON_VECTORS_GLSL

#ifdef TEXELS
#define READ_TEXELS(place, sampler, name) layout(set = 0, binding = place) uniform sampler name
#define READ_VEC2(place, Block, name) READ_TEXELS(place, samplerBuffer, name)
#define READ_VEC4(place, Block, name) READ_TEXELS(place, samplerBuffer, name)
#define READ_UVEC2(place, Block, name) READ_TEXELS(place, usamplerBuffer, name)
#define READ_UVEC4(place, Block, name) READ_TEXELS(place, usamplerBuffer, name)
#define AT(name, i) texelFetch(name, int(i))
#define AT2(name, i) texelFetch(name, int(i)).xy
#else
#define READ_ARRAY(place, Block, type, name) \
    layout(set = 0, binding = place) readonly buffer Block { type name[]; }
#define READ_VEC2(place, Block, name) READ_ARRAY(place, Block, vec2, name)
#define READ_VEC4(place, Block, name) READ_ARRAY(place, Block, vec4, name)
#define READ_UVEC2(place, Block, name) READ_ARRAY(place, Block, uvec2, name)
#define READ_UVEC4(place, Block, name) READ_ARRAY(place, Block, uvec4, name)
#define AT(name, i) name[i]
#define AT2(name, i) name[i]
#endif

#endif
