r"""The error model: the probability of each order, limit and error of a ladder, given the differences of its levels.

Levels with step sizes ``h_0 > h_1 > ... > h_L`` have the values ``u_k = u* + A h_k^p + B h_k^q + n_k`` on common points
of time or space, with unknown functions A and B and the noise n_k of level k. The *rows* are the differences
``d_k = u_k - u_(k+1)`` and, if the exact solution u is known, ``u_L - u``, which is the difference to a level of step
size 0. So a power p has the coefficient ``c_k(p) = h_k^p - h_(k+1)^p`` in row k, for any step sizes.

A *hypothesis* fixes the powers, the size of the second one relative to the first, the *window* of levels in which the
expansion holds, and how levels deviate from it. Its functions A and B are Gaussian, with a few independent points
(`POINTS`) and of unknown size. They integrate out, and the rows X have the evidence

    log p(X) = log(1/2) + log Gamma(n/2) - n/2 log(pi tr(K^-1 G)) - N/2 log det K,   n = N w,

for w rows and N independent points, with the Gram matrix ``G_kl = <d_k, d_l>`` of the rows and their covariance K under
the hypothesis. G is the only data the model reads. This is the integral of ``N(X; 0, s^2 K) ds/s``; estimates of A, B
and the limit take the most probable size, ``s^2 = tr(K^-1 G)/w``. Except for a factor that all hypotheses on w rows
share, the evidence is a power of one ratio (see `hypotheses.Table`). Six kinds of hypotheses compete:

- *two shapes*: A and B are unrelated. ``K = c(p) c(p)^T + r^2 c(q) c(q)^T + noise``, r the share of B;
- *one shape*: B is a multiple of A, of unknown sign and about the stated size. The components y of the rows along the
  last row d are scalars with the same K, and any direction of d is as probable, so they have the evidence
  ``2 p(y) Gamma(N/2)/(2 pi^(N/2) |d|^(N-1))``. The components orthogonal to it follow Student's t with `TAIL` degrees
  of freedom and the scale given by `MISFIT`;
- *off by factors*: the error of each level is off by a factor of its own (`JITTERS`), as where events fall between
  grid points. B is a multiple of A of a given size and sign, and may also have a shape of its own. The evidence is
  that of one shape, where the orthogonal components include the shape of B;
- *any power*: one power of any value near the measured order;
- *alternating*: the sign of the error alternates from level to level;
- *no expansion*: each row has an unrelated size, down to some level; all finer rows are noise.

In the first three kinds the second term may be h^p times a logarithm, as singularities make it.

Rows coarser than the window have not reached the expansion: each has an unrelated size, at the cost
`FREE_PENALTY`. Rows finer than the window are noise that grows as the steps shrink. Noise of the predicted size
costs least, and noise below what the expansion would leave there is improbable (`rows.Rows.outside`).

Hypotheses with provably negligible evidence are skipped: whole tables by the size of the last row, and groups of
hypotheses by one quadratic form: if C exceeds all their covariances K, ``tr(K^-1 G) >= tr(C^-1 G)``.

In the order of reading: `ladder` is the data, `priors` holds the constants, `posterior` sums over the windows, `rows`
has the evidence of what lies outside a window, `hypotheses` builds tables of the matrices of all hypotheses inside it,
`likelihood` turns them into log evidence, `kernel` loops over ladders and hypotheses, and `matrices` inverts.
"""
