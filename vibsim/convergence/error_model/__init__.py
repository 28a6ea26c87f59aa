r"""The error model: what the differences of a ladder of levels say about its order, its limit and its error.

Levels with step sizes ``h_0 > h_1 > ... > h_L`` have the values ``u_k = u* + A h_k^p + B h_k^q + n_k`` on common points
of time or space, with unknown functions A and B and the noise n_k of level k. The *rows* are the differences
``d_k = u_k - u_(k+1)`` and, where the exact solution u is known, ``u_L - u``, which is the difference to a level of the
size 0. So a power p has the coefficient ``c_k(p) = h_k^p - h_(k+1)^p`` in row k, whatever the sizes are.

A *hypothesis* says which powers there are, how large the second one is, over which *window* of levels this holds, and
how levels deviate from it. Its functions A and B are Gaussian, with a few independent points (`POINTS`) and of any
size. They integrate out, and the rows X have the evidence

    log p(X) = log(1/2) + log Gamma(n/2) - n/2 log(pi tr(K^-1 G)) - N/2 log det K,   n = N w,

for w rows and N independent points, with the Gram matrix ``G_kl = <d_k, d_l>`` of the rows and the covariance K that
the hypothesis gives them. G is all that is read of the data. Without logarithms, and but for what all hypotheses on w
rows share, this is a power of one ratio (see `hypotheses.Table`). Four kinds of hypotheses compete:

- *two shapes*: A and B are unrelated. ``K = c(p) c(p)^T + s^2 c(q) c(q)^T + noise``;
- *one shape*: B is any multiple of A of that size. The rows are read along the last one only, as numbers, with the
  same K; what they have across it follows Student's t with `TAIL` degrees of freedom and the size that `MISFIT` gives
  it;
- *off by factors*: the error of every level is off by a factor of its own (`JITTERS`), as where events fall between
  grid points. B is a multiple of A of a given size and sign, or has beside that a shape of its own. The rows are read
  as those of one shape, across the last one with the shape of B as well;
- *no expansion*: every row has a size of its own, all of them or up to one behind which all rows are noise.

Rows before a window are coarse levels that the expansion does not reach: each has a size of its own, for the price
`PRICE`. Rows behind it are noise that grows as the steps shrink; noise as large as its prediction costs least, and
noise that is smaller than what the expansion leaves there is improbable (`posterior._Fit.hidden`).

Hypotheses whose evidence is known to be next to nothing are not weighed: whole tables by the size of the last row, and
groups of hypotheses by one quadratic form: where a covariance C exceeds all theirs, ``tr(K^-1 G) >= tr(C^-1 G)``.

`hypotheses` lays the matrices of all hypotheses out in tables, `kernel` is the loop over ladders and hypotheses,
`likelihood` makes logarithms of evidence of it, `posterior` adds the windows up, and `priors` holds the numbers.
"""
