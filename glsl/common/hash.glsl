// Numbers in an order that looks random, each another one.
#ifndef COMMON_HASH_GLSL
#define COMMON_HASH_GLSL

// A bijection (the finalizer lowbias32 of Chris Wellons), so that no two numbers have the same hash.
uint hashed(uint x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    return x ^ x >> 16;
}

#endif
