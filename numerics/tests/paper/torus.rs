//! Queries and errors of the two tables on the ring torus, R₁ = 2, R₂ = ½, α = 1e-10.
//!
//! Queries are 32 equidistant points on the vertical circle at a random u. The outward curvatures, ascending,
//! are compared with `cos v/(R₁ + R₂ cos v)` and `1/R₂` (errata.md, 5). The paper's −2 has the inward sign.
//!
//! The paper orders its pairs "by size" without saying which entry is which. This order fits it best:
//! its L² errors differ by a factor 2 to 3, as ours do. Relative errors of a list are
//! `max|κ − κ*|/max|κ*|` and `|κ − κ*|₂/|κ*|₂`.

use std::f64::consts::TAU;

use super::common::clouds::{TORUS, cloud, torus_point};
use super::errors::{relative_l2, relative_max};
use super::support::{Orientation, Surface};

/// Columns of the table of one kernel.
pub const COLUMNS: [&str; 4] = ["Linf, cos v/(..)", "Linf, 1/R2", "L2, cos v/(..)", "L2, 1/R2"];

/// The paper's α.
pub const ALPHA: f64 = 1e-10;

/// Relative errors of the two curvatures: L∞ of each, then L² of each.
pub fn errors(surface: &Surface, u: f64) -> [f64; 4] {
    let [r1, r2] = TORUS;
    let angles: Vec<f64> = (0..32).map(|i| TAU * f64::from(i) / 32.0).collect();
    let queries = cloud(&angles.iter().map(|&v| torus_point(u, v)).collect::<Vec<_>>());
    let found = surface.curvatures(&queries, Orientation::Outward);
    // A null point makes the errors NaN, which no bound passes.
    let nth = |n: usize| found.iter().map(|k| k.as_ref().map_or(f64::NAN, |k| k[n])).collect::<Vec<f64>>();
    let (small, large) = (nth(0), nth(1));
    let exact_small: Vec<f64> = angles.iter().map(|v| v.cos() / (r1 + r2 * v.cos())).collect();
    let exact_large = vec![1.0 / r2; angles.len()];
    [
        relative_max(&small, &exact_small),
        relative_max(&large, &exact_large),
        relative_l2(&small, &exact_small),
        relative_l2(&large, &exact_large),
    ]
}
