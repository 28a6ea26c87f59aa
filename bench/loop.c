/* The loop of vibsim's pendulum kernel in C: the same arithmetic, the same sine, the same order of operations.

   step_only   positions and increments alone
   everything  with the energies, extrema, peaks and turns of every step, as the kernel gathers them

   Build: gcc -O3 -march=native -ffp-contract=off -shared -fPIC. */

#include <math.h>

static inline double sine(double x)
{
    const double inverse_pi = 0x1.45f306dc9c883p-2, round = 0x1.8p52;
    double r, rest;
    if (fabs(x) <= 0x1.921fb54442d18p+0) {
        r = x;
        rest = 0.0;
    } else if (fabs(x) <= 1e5) {
        double k = (x * inverse_pi + round) - round;
        double odd = k - 2.0 * ((0.5 * k + round) - round);
        double sign = 1.0 - 2.0 * (odd * odd);
        double coarse = x - k * 0x1.921fb54440000p+1;
        double fine = k * 0x1.68c234c4c0000p-38;
        r = coarse - fine;
        rest = sign * (((coarse - r) - fine) - k * 0x1.98a2e03707345p-76);
        r = sign * r;
    } else {
        return sin(x);
    }
    double z = r * r, z2 = z * z;
    double low = (-0.16666666666666666 + z * 0.008333333333333196)
        + z2 * (-0.00019841269841207676 + z * 2.7557319210712077e-06);
    double high = (-2.5052106827436554e-08 + z * 1.6058937294379453e-10)
        + z2 * (-7.64292780231204e-13 + z * 2.720508082623873e-15);
    double p = low + (z2 * z2) * high;
    return r + ((r * z) * p + rest * (1.0 - z * (0.5 - z * (1.0 / 24.0))));
}

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
   first and last pass over the top */
double everything(double theta, double omega, double g, double l, double m, double end, long steps,
                  double *out)
{
    const double turn = 6.283185307179586;
    double h = end / steps, u = theta, v = omega;
    double half = sine(0.5 * u), lv = l * v;
    double energy_0 = 0.5 * m * (lv * lv) + 2.0 * m * g * l * (half * half);
    double u_min = u, u_max = u, v_min = v, v_max = v, largest = 0.0, trough = NAN;
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
                       peaks[5], peaks[6], trough, turns[1], turns[2]};
    for (int i = 0; i < 15; i++)
        out[i] = values[i];
    return s.u;
}
