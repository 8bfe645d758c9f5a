/* Neighbouring floats, loaded and stored together.
 *
 * A Cortex-M4F loads n neighbours in 1 + n cycles by one instruction (vldm), and in 2 n by n of them; GCC
 * makes no vldm of single loads.  The last arguments are the registers to use there, in ascending order; which
 * ones decides only how many moves are needed.  Elsewhere they mean nothing, and this is plain C.
 *
 * Source: Cortex-M4 Technical Reference Manual, table of FPU instructions.
 *
 * What it does with bad input: it moves any bits.
 */
#ifndef FACTORLAB_BLOCKS_F32_H
#define FACTORLAB_BLOCKS_F32_H

#include "turning_f32.h"

#if defined(__GNUC__) && defined(__ARM_FP) && defined(__thumb2__)

#define REGISTER_F32(name, place) register float name __asm__(#place)

/* a and b, that lie side by side, to two vectors. */
#define LOAD_VECTORS_F32(a, b, u, v, r0, r1, r2, r3, r4, r5)                                                 \
    do {                                                                                                     \
        REGISTER_F32(f0, r0); REGISTER_F32(f1, r1); REGISTER_F32(f2, r2);                                    \
        REGISTER_F32(f3, r3); REGISTER_F32(f4, r4); REGISTER_F32(f5, r5);                                    \
        __asm__("vldmia %[p], {" #r0 "-" #r5 "}"                                                             \
                : "=t"(f0), "=t"(f1), "=t"(f2), "=t"(f3), "=t"(f4), "=t"(f5)                                 \
                : [p] "r"(a), "m"(*(const float(*)[6])(a)));                                                 \
        (u) = vector_f32(f0, f1, f2);                                                                        \
        (v) = vector_f32(f3, f4, f5);                                                                        \
    } while (0)

#define STORE_VECTORS_F32(a, b, u, v, r0, r1, r2, r3, r4, r5)                                                \
    do {                                                                                                     \
        REGISTER_F32(f0, r0) = (u).x; REGISTER_F32(f1, r1) = (u).y; REGISTER_F32(f2, r2) = (u).z;            \
        REGISTER_F32(f3, r3) = (v).x; REGISTER_F32(f4, r4) = (v).y; REGISTER_F32(f5, r5) = (v).z;            \
        __asm__("vstmia %[p], {" #r0 "-" #r5 "}"                                                             \
                : "=m"(*(float(*)[6])(a))                                                                    \
                : [p] "r"(a), "t"(f0), "t"(f1), "t"(f2), "t"(f3), "t"(f4), "t"(f5));                         \
    } while (0)

#define LOAD_VECTOR_F32(a, u, r0, r1, r2)                                                                    \
    do {                                                                                                     \
        REGISTER_F32(f0, r0); REGISTER_F32(f1, r1); REGISTER_F32(f2, r2);                                    \
        __asm__("vldmia %[p], {" #r0 "-" #r2 "}"                                                             \
                : "=t"(f0), "=t"(f1), "=t"(f2)                                                               \
                : [p] "r"(a), "m"(*(const float(*)[3])(a)));                                                 \
        (u) = vector_f32(f0, f1, f2);                                                                        \
    } while (0)

#define LOAD_PAIR_F32(a, x, y, r0, r1)                                                                       \
    do {                                                                                                     \
        REGISTER_F32(f0, r0); REGISTER_F32(f1, r1);                                                          \
        __asm__("vldmia %[p], {" #r0 "-" #r1 "}"                                                             \
                : "=t"(f0), "=t"(f1)                                                                         \
                : [p] "r"(a), "m"(*(const float(*)[2])(a)));                                                 \
        (x) = f0; (y) = f1;                                                                                  \
    } while (0)

#define STORE_PAIR_F32(a, x, y, r0, r1)                                                                      \
    do {                                                                                                     \
        REGISTER_F32(f0, r0) = (x); REGISTER_F32(f1, r1) = (y);                                              \
        __asm__("vstmia %[p], {" #r0 "-" #r1 "}"                                                             \
                : "=m"(*(float(*)[2])(a))                                                                    \
                : [p] "r"(a), "t"(f0), "t"(f1));                                                             \
    } while (0)

#define LOAD_QUATERNION_F32(a, q, r0, r1, r2, r3)                                                            \
    do {                                                                                                     \
        REGISTER_F32(f0, r0); REGISTER_F32(f1, r1); REGISTER_F32(f2, r2); REGISTER_F32(f3, r3);              \
        __asm__("vldmia %[p], {" #r0 "-" #r3 "}"                                                             \
                : "=t"(f0), "=t"(f1), "=t"(f2), "=t"(f3)                                                     \
                : [p] "r"(a), "m"(*(const float(*)[4])(a)));                                                 \
        (q).w = f0; (q).x = f1; (q).y = f2; (q).z = f3;                                                      \
    } while (0)

/* A quaternion a and a vector b that lie side by side. */
#define LOAD_ATTITUDE_F32(a, b, q, v, r0, r1, r2, r3, r4, r5, r6)                                            \
    do {                                                                                                     \
        REGISTER_F32(f0, r0); REGISTER_F32(f1, r1); REGISTER_F32(f2, r2); REGISTER_F32(f3, r3);              \
        REGISTER_F32(f4, r4); REGISTER_F32(f5, r5); REGISTER_F32(f6, r6);                                    \
        __asm__("vldmia %[p], {" #r0 "-" #r6 "}"                                                             \
                : "=t"(f0), "=t"(f1), "=t"(f2), "=t"(f3), "=t"(f4), "=t"(f5), "=t"(f6)                       \
                : [p] "r"(a), "m"(*(const float(*)[7])(a)));                                                 \
        (q).w = f0; (q).x = f1; (q).y = f2; (q).z = f3;                                                      \
        (v) = vector_f32(f4, f5, f6);                                                                        \
    } while (0)

#define STORE_ATTITUDE_F32(a, b, q, v, r0, r1, r2, r3, r4, r5, r6)                                           \
    do {                                                                                                     \
        REGISTER_F32(f0, r0) = (q).w; REGISTER_F32(f1, r1) = (q).x;                                          \
        REGISTER_F32(f2, r2) = (q).y; REGISTER_F32(f3, r3) = (q).z;                                          \
        REGISTER_F32(f4, r4) = (v).x; REGISTER_F32(f5, r5) = (v).y; REGISTER_F32(f6, r6) = (v).z;            \
        __asm__("vstmia %[p], {" #r0 "-" #r6 "}"                                                             \
                : "=m"(*(float(*)[7])(a))                                                                    \
                : [p] "r"(a), "t"(f0), "t"(f1), "t"(f2), "t"(f3), "t"(f4), "t"(f5), "t"(f6));                \
    } while (0)

#else

#define LOAD_VECTORS_F32(a, b, u, v, r0, r1, r2, r3, r4, r5) \
    do {                                                     \
        (u) = load_vector_f32(a);                            \
        (v) = load_vector_f32(b);                            \
    } while (0)

#define STORE_VECTORS_F32(a, b, u, v, r0, r1, r2, r3, r4, r5) \
    do {                                                      \
        store_vector_f32(a, u);                               \
        store_vector_f32(b, v);                               \
    } while (0)

#define LOAD_VECTOR_F32(a, u, r0, r1, r2) ((u) = load_vector_f32(a))

#define LOAD_PAIR_F32(a, x, y, r0, r1) \
    do {                               \
        (x) = (a)[0];                  \
        (y) = (a)[1];                  \
    } while (0)

#define STORE_PAIR_F32(a, x, y, r0, r1) \
    do {                                \
        (a)[0] = (x);                   \
        (a)[1] = (y);                   \
    } while (0)

#define LOAD_QUATERNION_F32(a, q, r0, r1, r2, r3) ((q) = load_quaternion_f32(a))

#define LOAD_ATTITUDE_F32(a, b, q, v, r0, r1, r2, r3, r4, r5, r6) \
    do {                                                          \
        (q) = load_quaternion_f32(a);                             \
        (v) = load_vector_f32(b);                                 \
    } while (0)

#define STORE_ATTITUDE_F32(a, b, q, v, r0, r1, r2, r3, r4, r5, r6) \
    do {                                                           \
        store_quaternion_f32(a, q);                                \
        store_vector_f32(b, v);                                    \
    } while (0)

#endif

#endif /* FACTORLAB_BLOCKS_F32_H */
