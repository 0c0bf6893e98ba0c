"""Error against measured time: N by every rule, M in four forms, and the sampler.

(a) N of R, TT and TRT in three channels (eta 1.55, sigma_a .15, .3, .6 per radius, five
theta_d up to 85 degrees), each value with a phi and a theta_d of its own. Errors are
the largest, relative to the peak over phi at that theta_d and channel; truth is
GaussGamma with 300 to 6000 nodes in float64, and what its rounding hides is shaded.
(b) N of TRT where 2048 phi share each theta_d. (c) M over 16 cones and all theta_o,
relative to the peak over theta_o: "naive" has csch and I0 as the papers print them,
"log I0" is the form of renderers, and "i0e" has jax's scaled I0 and the exponent of the
papers. A cross on the upper edge means that not every value is a number. (d) The
sampler: geometric mean of the variance of the weight over absorption and theta_i, by
roughness beta, against time per sample; variance times time is constant along the
slanted lines. The table has this variance in the column of the errors, and every lobe
and roughness of the grid.

A front joins the points of one precision, of those with an error below 1, that no other
beats in both error and time. The exp limit is the error of GaussGamma(n) at the time
that its exponentials alone take: 2 n for R, n (2 + 3) else, two of the detector at each
node and one of the absorption in each channel, each at the cost of one in a sum of 64
that XLA makes one loop. scipy integrates the textbook integral over h in plain Python,
at its default tolerance; its time is written beside it.

Times are medians on one machine and differ from run to run, so the files do too; the
calls take turns, so that their ratios mean more than the times do.
"""

from shared import m_forms, n_rules, strategies
from shared.panels import blocks
from shared.style import Drawing, run
from shared.timing import Row, medians, table

ROUNDS = 5


def measure() -> list[Row]:
    """Every row of the table."""
    n, exps, m = n_rules.calls(), n_rules.exp_calls(), m_forms.calls()
    times = medians({**n, **exps, **m}, ROUNDS)
    return [
        *(n_rules.row(key, call, times[key]) for key, call in n.items()),
        *n_rules.scipy_rows(),
        *(n_rules.exp_row(dtype, times[dtype]) for dtype in exps),
        *m_forms.rows(m, times),
        *strategies.rows(),
    ]


def draw():
    """Measure, and draw what came out."""
    rows = measure()
    return Drawing(blocks(rows), "Error of N, M and samples against time", table(rows))


def main(argv=None):
    """Draw error_vs_time.svg and write error_vs_time.csv."""
    run("error_vs_time", __doc__, draw, argv)


if __name__ == "__main__":
    main()
