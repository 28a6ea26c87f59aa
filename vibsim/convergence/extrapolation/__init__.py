r"""Extrapolation over the levels of a ladder: one triangular scheme and one rule for error bars.

Its numbers stand beside the verdicts on orders and decide none of them.

A level with step h has ``u_h = u + c_1 h^p + c_2 h^(p+q) + c_3 h^(p+2q) + ...``. Column 0 of the scheme holds the
levels. An entry of column j combines j + 1 successive levels so that the first j powers cancel,

    T[i][j] = T[i][j-1] + f (T[i][j-1] - T[i-1][j-1]),         f = 1/(K - 1),

where K is the factor by which the error of column j - 1 falls from row i - 1 to row i. Richardson extrapolation is
column 1, Romberg's method all columns. Levels may be skipped: f is computed in exact fractions.

If the entries of a column change by c from one row to the next, and these changes fall by the factor K per row, the
remaining error of the finer entry is

    c/(K - 1),         times a safety factor.

All error bars have this form (`triangular_scheme.error_left`). They differ in how well K is known, and so in the
safety factor:

- *grid convergence index* (`gci`): column 0, and the observed order if it is the promised one;
- *series* (`series`): columns 1 and 2. A curve over time has a shape, and K is measured in norms;
- *numbers* (`numbers`): all columns. A number has no shape, so the levels must show each power;
- *states* (`states`): all columns, at each time independently. The powers are those of the scheme and round-off is
  measured; entries that fall differently are trusted less.

Source: L. F. Richardson (1911); W. Romberg (1955); C. Brezinski's E-algorithm for unequal gaps; E. Hairer,
S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I, section II.9; pendulum lecture, section 2.5.
"""
