/* The loop of vibsim's pendulum kernel in C: the same arithmetic, the same sine, the same order of operations.

   step_only   positions and increments alone
   everything  with the energies, extrema, norms, peaks and turns of every step, as the kernel gathers them

   bench/traced.py writes sine.h; beyond 1e5 it calls libm, where no benchmark goes.

   Build: gcc -O3 -march=native -ffp-contract=off -shared -fPIC. */

#include "sine.h"

typedef struct { double u, d, u_rest, d_rest; } state;

static inline state start(double theta, double omega, double h, double g_over_l)
{
    double kick = 0.5 * (h * h) * (-g_over_l * sine(theta)), push = h * omega;
    double d = push + kick, part = d - push;
    double d_rest = (push - (d - part)) + (kick - part);
    double ahead = theta + d;
    part = ahead - theta;
    return (state){ahead, d, (theta - (ahead - part)) + (d - part), d_rest};
}

static inline state step(state s, double h, double g_over_l, double *v)
{
    double kick = (h * h) * (-g_over_l * sine(s.u)) + s.d_rest;
    double d = s.d + kick, part = d - s.d;
    double d_rest = (s.d - (d - part)) + (kick - part);
    double drift = d + s.u_rest, ahead = s.u + drift;
    part = ahead - s.u;
    *v = (s.d + d) * (0.5 / h);
    return (state){ahead, d, (s.u - (ahead - part)) + (drift - part), d_rest};
}

double step_only(double theta, double omega, double g, double l, double end, long steps)
{
    double h = end / steps, v;
    state s = start(theta, omega, h, g / l);
    for (long n = 1; n < steps; n++)
        s = step(s, h, g / l, &v);
    return s.u;
}

double three_term_libm(double theta, double omega, double g, double l, double end, long steps)
{
    double h = end / steps, before = theta;
    double u = theta + h * omega - 0.5 * (h * h) * (g / l) * sin(theta);
    for (long n = 1; n < steps; n++) {
        double ahead = 2.0 * u - before - (h * h) * (g / l) * sin(u);
        before = u;
        u = ahead;
    }
    return u;
}

/* out: position, extrema (4), largest deviation, first and last peak (time, at grid points, height), trough,
   first and last pass over the top, norms of position and velocity */
double everything(double theta, double omega, double g, double l, double m, double end, long steps,
                  double *out)
{
    const double turn = 6.283185307179586;
    double h = end / steps, u = theta, v = omega;
    double half = sine(0.5 * u), lv = l * v;
    double energy_0 = 0.5 * m * (lv * lv) + 2.0 * m * g * l * (half * half);
    double u_min = u, u_max = u, v_min = v, v_max = v, largest = 0.0, trough = NAN;
    double u_sum = fabs(u), u_squares = u * u, v_sum = fabs(v), v_squares = v * v;
    double peaks[7] = {0.0, NAN, NAN, NAN, NAN, NAN, NAN}, turns[3] = {0.0, NAN, NAN}, bottom = 0.0;
    state s = start(theta, omega, h, g / l);
    for (long n = 1; n < steps; n++) {
        double t = n * h, u_before = u, v_before = v;
        u = s.u;
        s = step(s, h, g / l, &v);
        if (!(fabs(u) + fabs(v) < 1e150))
            break;
        half = sine(0.5 * u);
        lv = l * v;
        double size = fabs((0.5 * m * (lv * lv) + 2.0 * m * g * l * (half * half)) - energy_0);
        u_min = u < u_min ? u : u_min;
        u_max = u > u_max ? u : u_max;
        v_min = v < v_min ? v : v_min;
        v_max = v > v_max ? v : v_max;
        largest = size > largest ? size : largest;
        u_sum += fabs(u);
        u_squares += u * u;
        v_sum += fabs(v);
        v_squares += v * v;
        if (v_before >= 0.0 && v < 0.0) {
            double share = v_before / (v_before - v);
            peaks[2] = t + (share - 1.0) * h;
            peaks[4] = u_before >= u ? t - h : t;
            peaks[6] = u_before + 0.5 * (share * h) * v_before;
            if (peaks[0] == 0.0) {
                peaks[1] = peaks[2];
                peaks[3] = peaks[4];
                peaks[5] = peaks[6];
            }
            peaks[0] += 1.0;
        }
        if (v_before <= 0.0 && v > 0.0)
            trough = u_before + 0.5 * (v_before / (v_before - v) * h) * v_before;
        if (fabs(u - bottom) > 0.5 * turn) {
            double ahead = u > bottom ? turn : -turn;
            turns[2] = t + ((bottom + 0.5 * ahead - u_before) / (u - u_before) - 1.0) * h;
            if (turns[0] == 0.0)
                turns[1] = turns[2];
            turns[0] += 1.0;
            bottom += ahead;
        }
    }
    double values[] = {s.u, u_min, u_max, v_min, v_max, largest, peaks[1], peaks[2], peaks[3], peaks[4],
                       peaks[5], peaks[6], trough, turns[1], turns[2], h * u_sum, sqrt(h * u_squares),
                       h * v_sum, sqrt(h * v_squares)};
    for (int i = 0; i < 19; i++)
        out[i] = values[i];
    return s.u;
}
