//! What every path must satisfy: its derivatives are those of its position.

use super::Path;

/// Compares p', p'' and p''' with differences of p, p' and p'' at `xi`.
pub(super) fn assert_derivatives_agree(path: &dyn Path, xi: f64) {
    let h = 1e-5 * (1.0 + xi.abs());
    let (before, here, after) = (path.at(xi - h), path.at(xi), path.at(xi + h));
    for (name, exact, difference) in [
        ("p'", here.d1, (after.p - before.p) / (2.0 * h)),
        ("p''", here.d2, (after.d1 - before.d1) / (2.0 * h)),
        ("p'''", here.d3, (after.d2 - before.d2) / (2.0 * h)),
    ] {
        let tolerance = 1e-6 * (1.0 + exact.norm());
        assert!((exact - difference).norm() < tolerance, "{name} at {xi}: {exact} but differences give {difference}");
    }
}
