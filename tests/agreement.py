"""Two pictures of one scene, by different programs: do they differ by more than their noise?"""

import numpy as np
from scipy import stats


def assert_agree(ours, theirs, *, bias=1e-5, significance=1e-3):
    """Test pixels one by one and all together.

    Both arguments are pairs of means and variances of the means. The largest z-score is held to
    the level of Sidak's correction for its number, the sum of squares to a chi-square. `bias` is a
    relative difference that is known and allowed, no less than single precision leaves; pixels
    with less noise than that are held to it alone.
    """
    (a, var_a), (b, var_b) = ours, theirs
    difference, variance = np.asarray(a - b, float), np.asarray(var_a + var_b, float)
    noisy = np.sqrt(variance) > bias * np.abs(b)
    np.testing.assert_allclose(a[~noisy], b[~noisy], rtol=10 * bias)
    variance += (bias * b) ** 2
    z = difference[noisy] / np.sqrt(variance[noisy])
    assert z.size > 15, "too few pixels to tell"
    largest = stats.norm.isf(0.5 * (1 - (1 - significance) ** (1 / z.size)))
    summary = (
        f"{z.size} pixels, z {z.mean():+.3f} +- {z.std():.3f}, largest {np.abs(z).max():.2f}"
        f" (allowed {largest:.2f}), means {a.mean():.5f} {b.mean():.5f}"
    )
    print(summary)
    assert np.abs(z).max() < largest, summary
    assert abs(z.mean()) * np.sqrt(z.size) < stats.norm.isf(0.5 * significance), summary
    assert stats.chi2.sf((z**2).sum(), z.size) > significance, summary
