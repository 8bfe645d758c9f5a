#include "mahony_f32.h"

#include "blocks_f32.h"

#define OLDEST 0.2f           /* s that one reading of the field stands for at most */
#define SMOOTH 0.5f           /* s, time constant of what rest is judged by */
#define STEEP_SQUARED 2.5e-7f /* 1/4 sin^2 of the angle to the vertical below which a field has no heading */

/* Low-pass gyro and accelerometer, and count the time at rest; whether it rests. */
INLINE_F32 int rest(struct mahony_f32_state *restrict s, const struct mahony_f32_derived *restrict d,
                    struct vector_f32 gyro, struct vector_f32 accel, float dt)
{
    const float keep = dt / (SMOOTH + dt);
    struct vector_f32 mean_gyro, mean_accel;
    LOAD_VECTORS_F32(s->mean_gyro, s->mean_accel, mean_gyro, mean_accel, s6, s7, s8, s9, s10, s11);
    mean_gyro = drawn_f32(mean_gyro, gyro, keep);
    mean_accel = drawn_f32(mean_accel, accel, keep);
    STORE_VECTORS_F32(s->mean_gyro, s->mean_accel, mean_gyro, mean_accel, s6, s7, s8, s9, s10, s11);
    if (!(near_f32(gyro, mean_gyro, d->rest_gyro) && near_f32(accel, mean_accel, d->rest_accel)
          && below_f32(mean_gyro.x, d->bias_bound) && below_f32(mean_gyro.y, d->bias_bound)
          && below_f32(mean_gyro.z, d->bias_bound))) {
        s->at_rest = 0.0f;
        return 0;
    }
    s->at_rest += dt;
    return s->at_rest > d->rest_time;
}

/* The time that the accelerometer's error counts for: less where it is longer than its limit.
 * A tilt error lasts in the world, a push does not. */
INLINE_F32 float counting(struct mahony_f32_state *restrict s, const struct mahony_f32_derived *restrict d,
                          float east, float south, float dt)
{
    const float keep = dt / (d->lasting_time + dt), squared = east * east + south * south;
    float lasting_east, lasting_north;
    LOAD_PAIR_F32(s->lasting, lasting_east, lasting_north, s9, s10);
    lasting_east += (east - lasting_east) * keep;
    lasting_north -= (south + lasting_north) * keep;
    STORE_PAIR_F32(s->lasting, lasting_east, lasting_north, s9, s10);
    const float limit = d->error_limit + sqrtf(lasting_east * lasting_east + lasting_north * lasting_north);
    if (squared > limit * limit && !s->starting) {
        dt *= limit / sqrtf(squared);
    }
    return dt;
}

/* The published error of the field, m/|m| x n, which leans on roll and pitch as well. */
static struct vector_f32 published_error(struct vector_f32 north, struct vector_f32 up, struct vector_f32 mag)
{
    const struct vector_f32 m = scaled_f32(mag, 1.0f / sqrtf(dot_f32(mag, mag)));
    const float along = 2.0f * dot_f32(up, m); /* component of the field along the vertical */
    const float across = 1.0f - along * along;
    const float flat = across > 0.0f ? sqrtf(across) : 0.0f;
    const struct vector_f32 n = plus_f32(scaled_f32(north, 2.0f * flat), up, 2.0f * along);
    return cross_f32(m, n);
}

/* Half the vertical, about which a heading error turns, or the published error. */
struct heading {
    struct vector_f32 axis; /* 1/2 */
    float times;            /* s, the time that it counts for, times the error's sine */
};

/* The field off its gate or behind: a disturbance until the timeout, then the whole of the error's sign. */
static float far_off(struct mahony_f32_state *restrict s, const struct mahony_f32_derived *restrict d,
                     float north, float east, float age)
{
    if (north < d->gate_cosine) {
        if (s->out_of_gate <= d->heading_timeout) {
            s->out_of_gate += age;
        }
        if (s->out_of_gate <= d->heading_timeout) {
            return 0.0f;
        }
    } else {
        s->out_of_gate = 0.0f;
    }
    return north > 0.0f ? age * east : (east < 0.0f ? -age : age);
}

/* Heading error times the time that the field stands for; the first field sets north. */
INLINE_F32 struct heading heading_error(struct mahony_f32_state *restrict s,
                                        const struct mahony_f32_derived *restrict d,
                                        struct level_rows_f32 rows, struct vector_f32 mag, float dt,
                                        struct quaternion_f32 *q)
{
    struct heading none = {{0.0f, 0.0f, 0.0f}, 0.0f}, found;
    const float east = dot_f32(rows.east, mag), north = dot_f32(rows.north, mag);
    const float level = east * east + north * north; /* uT^2, a quarter of the level part */
    float age = s->since_field + dt;
    if (!(level > STEEP_SQUARED * dot_f32(mag, mag))) {
        s->since_field = age;
        return none;
    }
    const float length = sqrtf(level);
    s->since_field = 0.0f;
    if (RARELY_F32(!s->heading_known)) {
        if (usable_f32(level)) { /* or else it is no unit vector */
            *q = north_set_f32(*q, east / length, north / length);
            s->heading_known = 1;
        }
        return none;
    }
    if (RARELY_F32(age > OLDEST)) {
        age = OLDEST;
    }
    if (RARELY_F32(north < d->gate_ahead * length)) {
        found.times = far_off(s, d, north / length, east / length, age);
    } else {
        s->out_of_gate = 0.0f;
        found.times = age * east / length;
    }
    found.axis = half_up_f32(*q);
    if (RARELY_F32(d->tilt_by_field)) {
        found.axis = scaled_f32(published_error(rows.north, found.axis, mag), 0.5f);
        found.times = found.times != 0.0f ? age : 0.0f;
    }
    return found;
}

/* A time step that nothing is integrated over begins the quick start anew. */
static void begin(struct mahony_f32_state *restrict s)
{
    s->since_start = 0.0f;
    s->at_rest = 0.0f;
    s->starting = 1;
}

/* What the quick start adds to the gains. */
static float boost(const struct mahony_f32_state *s, const struct mahony_f32_derived *d)
{
    return d->boost * (1.0f - s->since_start * d->start_rate);
}

/* A step, with or without a magnetometer: the compiler makes two functions of it. */
INLINE_F32 void step(struct mahony_f32_state *restrict s, const struct mahony_f32_derived *restrict d,
                     const struct imu_f32 *restrict sample, float dt, int with_field)
{
    struct vector_f32 gyro, accel, bias, tilt = {0.0f, 0.0f, 0.0f};
    struct heading heading = {{0.0f, 0.0f, 0.0f}, 0.0f};
    struct quaternion_f32 q;
    float counts = 0.0f;
    int resting = 0;
    LOAD_VECTORS_F32(sample->gyro, sample->accel, gyro, accel, s15, s16, s17, s18, s19, s20);
    if (RARELY_F32(!is_rate_f32(gyro))) {
        return;
    }
    if (RARELY_F32(!steady_f32(dt))) {
        begin(s);
        dt = 0.0f;
    }
    if (RARELY_F32(s->starting)) {
        s->since_start += dt;
        s->starting = s->since_start < d->start_time;
    }
    const float force = dot_f32(accel, accel);
    const int bad = !usable_f32(force);
    if (bad) {
        s->at_rest = 0.0f;
    } else {
        resting = rest(s, d, gyro, accel, dt);
    }
    LOAD_QUATERNION_F32(s->world_q_body, q, s2, s3, s4, s5);
    const struct level_rows_f32 rows = level_rows_f32(q);
    if (!bad) {
        const float scale = 2.0f / sqrtf(force);
        const float east = scale * dot_f32(rows.north, accel), south = scale * dot_f32(rows.east, accel);
        tilt = minus_f32(scaled_f32(rows.east, east), rows.north, south);
        counts = counting(s, d, east, south, dt);
    }
    if (with_field) {
        struct vector_f32 mag;
        LOAD_VECTOR_F32(sample->mag, mag, s26, s27, s28);
        heading = heading_error(s, d, rows, mag, dt, &q);
    }
    struct vector_f32 gains; /* of tilt, heading, and both in the integral */
    LOAD_VECTOR_F32(d->gains, gains, s27, s28, s29);
    LOAD_VECTOR_F32(s->gyro_bias, bias, s12, s13, s14);
    if (RARELY_F32(resting)) {
        bias = drawn_f32(bias, load_vector_f32(s->mean_gyro), dt / (d->rest_constant + dt));
    }
    if (RARELY_F32(s->starting)) {
        gains.x += boost(s, d);
        gains.y += boost(s, d);
    } else if (!resting) {
        bias = minus_f32(bias, tilt, gains.z * counts);
        if (with_field) {
            bias = minus_f32(bias, heading.axis, gains.z * heading.times);
        }
    }
    bias = limited_f32(bias, d->bias_limit, d->bias_bound);
    struct vector_f32 r = plus_f32(scaled_f32(minus_f32(gyro, bias, 1.0f), dt), tilt, gains.x * counts);
    if (with_field) {
        r = plus_f32(r, heading.axis, gains.y * heading.times);
    }
    q = turned_f32(q, scaled_f32(r, 0.5f + d->third * dot_f32(r, r)));
    STORE_ATTITUDE_F32(s->world_q_body, s->gyro_bias, q, bias, s8, s9, s10, s11, s12, s13, s14);
}

void mahony_f32_step(struct mahony_f32_state *restrict s, const struct mahony_f32_derived *restrict d,
                     const struct imu_f32 *restrict sample, float dt)
{
    step(s, d, sample, dt, 1);
}

void mahony_f32_step_6d(struct mahony_f32_state *restrict s, const struct mahony_f32_derived *restrict d,
                        const struct imu_f32 *restrict sample, float dt)
{
    step(s, d, sample, dt, 0);
}

void mahony_f32_start(struct mahony_f32_state *restrict s, const struct mahony_f32_derived *restrict d,
                      const struct imu_f32 *restrict first)
{
    const struct vector_f32 gyro = load_vector_f32(first->gyro), accel = load_vector_f32(first->accel);
    (void)d;
    memset(s, 0, sizeof *s);
    store_quaternion_f32(s->world_q_body, level_f32(accel));
    if (is_rate_f32(gyro)) {
        store_vector_f32(s->mean_gyro, gyro);
    }
    if (usable_f32(dot_f32(accel, accel))) {
        store_vector_f32(s->mean_accel, accel);
    }
    s->starting = 1;
}

void mahony_f32_attitude(const struct mahony_f32_state *s, float world_q_body[4])
{
    memcpy(world_q_body, s->world_q_body, sizeof s->world_q_body);
}

int mahony_f32_rests(const struct mahony_f32_state *s, const struct mahony_f32_derived *d)
{
    return s->at_rest > d->rest_time;
}

int mahony_f32_disturbed(const struct mahony_f32_state *s)
{
    return s->out_of_gate > 0.0f;
}
