/* A chain of N masses between walls (Fermi, Pasta, Ulam, Tsingou) by velocity Verlet, as one would write it by hand.

   Build: gcc -O3 -march=native -ffp-contract=off -DN=64 -shared -fPIC. */

static void acceleration(const double *q, double alpha, double *a)
{
    for (int i = 0; i < N; i++) {
        double right = (i + 1 < N ? q[i + 1] : 0.0) - q[i], left = q[i] - (i ? q[i - 1] : 0.0);
        a[i] = right - left + alpha * (right * right - left * left);
    }
}

double chain(double *q, double *v, double alpha, double dt, long steps)
{
    double a[N];
    acceleration(q, alpha, a);
    for (long n = 0; n < steps; n++) {
        for (int i = 0; i < N; i++) {
            v[i] += 0.5 * dt * a[i];
            q[i] += dt * v[i];
        }
        acceleration(q, alpha, a);
        for (int i = 0; i < N; i++)
            v[i] += 0.5 * dt * a[i];
    }
    return q[0];
}
