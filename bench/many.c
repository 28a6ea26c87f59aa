/* Many members in C: members are the inner loop, in blocks that stay in the first cache, as the engine's SIMD lane has them.

   compensated  positions alone, the same arithmetic and the same sine as the engine
   increment    the same without the compensation
   everything   compensated, with the energies, extrema, norms, peaks and turns of every step
   three_term_libm, three_term_libmvec  what one writes with the library's sine

   Build: gcc -O3 -march=native -ffp-contract=off -shared -fPIC. */

#include "sine.h"

#define BLOCK 64
#define HALF_TURN 3.141592653589793
#define TURN 6.283185307179586

/* Whole cache lines: a vector of 512 bits that lies across two costs twice. */
#define LINE _Alignas(64)

typedef struct { LINE double u[BLOCK]; double d[BLOCK], u_rest[BLOCK], d_rest[BLOCK]; } block;

static inline double force(double u, int far)
{
    return far ? sine(u) : sine_n(u);
}

static inline void start(block *s, int i, double u, double v, double h, double g_over_l)
{
    double kick = 0.5 * (h * h) * (-g_over_l * sine(u)), push = h * v;
    double d = push + kick, part = d - push;
    s->d_rest[i] = (push - (d - part)) + (kick - part);
    s->d[i] = d;
    double ahead = u + d;
    part = ahead - u;
    s->u_rest[i] = (u - (ahead - part)) + (d - part);
    s->u[i] = ahead;
}

/* One step of one member; returns the velocity at the present time. */
static inline double step(block *s, int i, double h, double g_over_l, int far)
{
    double kick = (h * h) * (-g_over_l * force(s->u[i], far)) + s->d_rest[i];
    double d_before = s->d[i], d = d_before + kick, part = d - d_before;
    s->d_rest[i] = (d_before - (d - part)) + (kick - part);
    s->d[i] = d;
    double u = s->u[i], drift = d + s->u_rest[i], ahead = u + drift;
    part = ahead - u;
    s->u_rest[i] = (u - (ahead - part)) + (drift - part);
    s->u[i] = ahead;
    return (d_before + d) * (0.5 / h);
}

static inline long is_far(double u) { return !(fabs(u) <= LARGEST); }

/* A block beyond the reach of sine_n takes the slow way; `far` is constant in each copy of the loop. */
void compensated(long members, const double *theta, double g, double l, double h, long steps, double *out)
{
    for (long first = 0; first < members; first += BLOCK) {
        block s;
        long far = 0;
        for (int i = 0; i < BLOCK; i++)
            start(&s, i, theta[first + i], 0.0, h, g / l);
        for (long n = 1; n < steps; n++) {
            long next = 0;
            if (far)
                for (int i = 0; i < BLOCK; i++) {
                    step(&s, i, h, g / l, 1);
                    next |= is_far(s.u[i]);
                }
            else
                for (int i = 0; i < BLOCK; i++) {
                    step(&s, i, h, g / l, 0);
                    next |= is_far(s.u[i]);
                }
            far = next;
        }
        for (int i = 0; i < BLOCK; i++)
            out[first + i] = s.u[i];
    }
}

void increment(long members, const double *theta, double g, double l, double h, long steps, double *out)
{
    double g_over_l = g / l;
    for (long first = 0; first < members; first += BLOCK) {
        LINE double u[BLOCK], d[BLOCK];
        long far = 0;
        for (int i = 0; i < BLOCK; i++) {
            d[i] = h * 0.0 + 0.5 * (h * h) * (-g_over_l * sine(theta[first + i]));
            u[i] = theta[first + i] + d[i];
        }
        for (long n = 1; n < steps; n++) {
            long next = 0;
            if (far)
                for (int i = 0; i < BLOCK; i++) {
                    d[i] = d[i] + (h * h) * (-g_over_l * sine(u[i]));
                    u[i] = u[i] + d[i];
                    next |= is_far(u[i]);
                }
            else
                for (int i = 0; i < BLOCK; i++) {
                    d[i] = d[i] + (h * h) * (-g_over_l * sine_n(u[i]));
                    u[i] = u[i] + d[i];
                    next |= is_far(u[i]);
                }
            far = next;
        }
        for (int i = 0; i < BLOCK; i++)
            out[first + i] = u[i];
    }
}

typedef struct {
    LINE double u[BLOCK];
    double v[BLOCK], u_before[BLOCK], v_before[BLOCK], energy_0[BLOCK], bottom[BLOCK];
    double u_min[BLOCK], u_max[BLOCK], v_min[BLOCK], v_max[BLOCK], largest[BLOCK], good[BLOCK];
    double u_sum[BLOCK], u_squares[BLOCK], v_sum[BLOCK], v_squares[BLOCK];
    double peak[7][BLOCK], trough[BLOCK], turns[3][BLOCK];
} gathered;

static inline double energy(double u, double v, double g, double l, double m, int far)
{
    double half = force(0.5 * u, far), lv = l * v;
    return 0.5 * m * (lv * lv) + 2.0 * m * g * l * (half * half);
}

/* Peaks, troughs and turns: seldom, hence not in the vector loop. */
static void note(gathered *a, int i, double t, double h)
{
    double u = a->u[i], v = a->v[i], u_before = a->u_before[i], v_before = a->v_before[i];
    if (!(fabs(u) + fabs(v) < 1e150))
        return;
    a->good[i] = t;
    if (v_before >= 0.0 && v < 0.0) {
        double share = v_before / (v_before - v);
        a->peak[2][i] = t + (share - 1.0) * h;
        a->peak[4][i] = u_before >= u ? t - h : t;
        a->peak[6][i] = u_before + 0.5 * (share * h) * v_before;
        if (a->peak[0][i] == 0.0)
            for (int k = 1; k < 6; k += 2)
                a->peak[k][i] = a->peak[k + 1][i];
        a->peak[0][i] += 1.0;
    }
    if (v_before <= 0.0 && v > 0.0)
        a->trough[i] = u_before + 0.5 * (v_before / (v_before - v) * h) * v_before;
    if (fabs(u - a->bottom[i]) > HALF_TURN) {
        double ahead = u > a->bottom[i] ? TURN : -TURN;
        a->turns[2][i] = t + ((a->bottom[i] + 0.5 * ahead - u_before) / (u - u_before) - 1.0) * h;
        if (a->turns[0][i] == 0.0)
            a->turns[1][i] = a->turns[2][i];
        a->turns[0][i] += 1.0;
        a->bottom[i] += ahead;
    }
}

static inline long gather(gathered *a, int i, double u, double v, double g, double l, double m, int far)
{
    double u_before = a->u[i], v_before = a->v[i];
    double size = fabs(energy(u, v, g, l, m, far) - a->energy_0[i]);
    a->u_before[i] = u_before;
    a->v_before[i] = v_before;
    a->u[i] = u;
    a->v[i] = v;
    a->u_min[i] = u < a->u_min[i] ? u : a->u_min[i];
    a->u_max[i] = u > a->u_max[i] ? u : a->u_max[i];
    a->v_min[i] = v < a->v_min[i] ? v : a->v_min[i];
    a->v_max[i] = v > a->v_max[i] ? v : a->v_max[i];
    a->largest[i] = size > a->largest[i] ? size : a->largest[i];
    a->u_sum[i] += fabs(u);
    a->u_squares[i] += u * u;
    a->v_sum[i] += fabs(v);
    a->v_squares[i] += v * v;
    return ((v_before >= 0.0) & (v < 0.0)) | ((v_before <= 0.0) & (v > 0.0))
        | (fabs(u - a->bottom[i]) > HALF_TURN) | !(fabs(u) + fabs(v) < 1e150);
}

static void begin(gathered *a, int i, double u, double g, double l, double m)
{
    a->u[i] = a->u_min[i] = a->u_max[i] = u;
    a->u_sum[i] = fabs(u);
    a->u_squares[i] = u * u;
    a->v_sum[i] = a->v_squares[i] = 0.0;
    a->v[i] = a->v_min[i] = a->v_max[i] = a->largest[i] = a->bottom[i] = a->good[i] = 0.0;
    a->energy_0[i] = energy(u, 0.0, g, l, m, 1);
    a->peak[0][i] = a->turns[0][i] = 0.0;
    a->trough[i] = a->turns[1][i] = a->turns[2][i] = NAN;
    for (int k = 1; k < 7; k++)
        a->peak[k][i] = NAN;
}

/* out: 20 rows of `members` values: position; its least and largest value; the same of the velocity; largest deviation;
   first and last peak (time, at grid points, height); trough; first and last pass over the top; last good time;
   norms of position and velocity */
void everything(long members, const double *theta, double g, double l, double m, double h, long steps,
                double *out)
{
    for (long first = 0; first < members; first += BLOCK) {
        block s;
        gathered a;
        long far = 0;
        for (int i = 0; i < BLOCK; i++) {
            begin(&a, i, theta[first + i], g, l, m);
            start(&s, i, theta[first + i], 0.0, h, g / l);
        }
        for (long n = 1; n < steps; n++) {
            long event = 0, next = 0;
            if (far)
                for (int i = 0; i < BLOCK; i++) {
                    double u = s.u[i];
                    event |= gather(&a, i, u, step(&s, i, h, g / l, 1), g, l, m, 1);
                    next |= is_far(s.u[i]);
                }
            else
                for (int i = 0; i < BLOCK; i++) {
                    double u = s.u[i];
                    event |= gather(&a, i, u, step(&s, i, h, g / l, 0), g, l, m, 0);
                    next |= is_far(s.u[i]);
                }
            if (event)
                for (int i = 0; i < BLOCK; i++)
                    note(&a, i, n * h, h);
            far = next;
        }
        for (int i = 0; i < BLOCK; i++) {
            double row[] = {s.u[i], a.u_min[i], a.u_max[i], a.v_min[i], a.v_max[i], a.largest[i],
                            a.peak[1][i], a.peak[2][i], a.peak[3][i], a.peak[4][i], a.peak[5][i],
                            a.peak[6][i], a.trough[i], a.turns[1][i], a.turns[2][i], a.good[i],
                            h * a.u_sum[i], sqrt(h * a.u_squares[i]), h * a.v_sum[i], sqrt(h * a.v_squares[i])};
            for (int k = 0; k < 20; k++)
                out[k * members + first + i] = row[k];
        }
    }
}

void three_term_libm(long members, const double *theta, double g, double l, double h, long steps,
                     double *out)
{
    for (long i = 0; i < members; i++) {
        double before = theta[i], u = before - 0.5 * (h * h) * (g / l) * sin(before);
        for (long n = 1; n < steps; n++) {
            double ahead = 2.0 * u - before - (h * h) * (g / l) * sin(u);
            before = u;
            u = ahead;
        }
        out[i] = u;
    }
}

#ifdef LIBMVEC
double sin(double) __attribute__((__simd__("notinbranch")));

void three_term_libmvec(long members, const double *theta, double g, double l, double h, long steps,
                        double *out)
{
    double g_over_l = g / l;
    for (long first = 0; first < members; first += BLOCK) {
        LINE double before[BLOCK], u[BLOCK];
        for (int i = 0; i < BLOCK; i++) {
            before[i] = theta[first + i];
            u[i] = before[i] - 0.5 * (h * h) * g_over_l * sin(before[i]);
        }
        for (long n = 1; n < steps; n++)
            for (int i = 0; i < BLOCK; i++) {
                double ahead = 2.0 * u[i] - before[i] - (h * h) * g_over_l * sin(u[i]);
                before[i] = u[i];
                u[i] = ahead;
            }
        for (int i = 0; i < BLOCK; i++)
            out[first + i] = u[i];
    }
}
#endif
