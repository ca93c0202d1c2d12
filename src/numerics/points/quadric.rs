//! Quadrics through the nearest points.
//!
//! A second opinion on normals and curvatures that knows neither kernel nor length scale: it sees the positions of a few
//! neighbours and nothing else.

use super::patch::{Patch, PatchNumbers};
use crate::numerics::machine::small::{Small, zeros};

/// Neighbours per coefficient of a quadric: 18 for surfaces in space.
const NEIGHBOURS_PER_COEFFICIENT: usize = 3;

/// Diagonal entries of R below this fraction of the largest mean that the neighbours do not determine a quadric.
const RANK_TOLERANCE: f64 = 1e-6;

/// Coefficients of a quadric over d − 1 tangential coordinates: `d(d+1)/2`.
pub(crate) fn n_coefficients(dimension: usize) -> usize {
    dimension * (dimension + 1) / 2
}

/// Neighbours that a quadric is fitted to by default.
pub(crate) fn n_quadric_neighbours(dimension: usize) -> usize {
    NEIGHBOURS_PER_COEFFICIENT * n_coefficients(dimension)
}

/// `z = height + slope·t + ½ tᵀ hessian t` in the frame and scale of a patch.
pub(crate) struct Quadric {
    pub height: f64,
    /// `[d−1]`.
    pub slope: Small,
    /// `[d−1, d−1]`.
    pub hessian: Small,
    /// Root mean square of what it leaves, corrected for the degrees of freedom.
    pub residual: f64,
}

impl Quadric {
    /// The least-squares quadric of heights over tangential coordinates; `None` if the points do not determine it.
    pub(crate) fn of(patch: &Patch) -> Option<Self> {
        let d = patch.dimension();
        let (k, p) = (d - 1, n_coefficients(d));
        let n = patch.n_points();
        if n < p {
            return None;
        }
        let mut rows = PatchNumbers::with_capacity(n * p);
        let mut heights = PatchNumbers::with_capacity(n);
        for t in patch.coordinates().chunks_exact(d) {
            rows.push(1.0);
            rows.extend_from_slice(&t[..k]);
            for a in 0..k {
                rows.extend((a..k).map(|b| if a == b { 0.5 * t[a] * t[a] } else { t[a] * t[b] }));
            }
            heights.push(t[k]);
        }
        let (coefficients, squared_residual) = least_squares(&mut rows, &mut heights, p)?;
        let mut hessian = zeros(k * k);
        let mut at = d;
        for a in 0..k {
            for b in a..k {
                (hessian[a * k + b], hessian[b * k + a]) = (coefficients[at], coefficients[at]);
                at += 1;
            }
        }
        let freedom = (n - p).max(1) as f64;
        Some(Self {
            height: coefficients[0],
            slope: Small::from_slice(&coefficients[1..d]),
            hessian,
            residual: (squared_residual / freedom).sqrt(),
        })
    }
}

/// Minimises `|Ac − b|` by Householder reflections in place (Golub and Van Loan 2013, sec. 5.2.2), A row-major `[n, p]`.
/// Answers c and the squared residual; `None` if A has not full rank.
fn least_squares(a: &mut [f64], b: &mut [f64], p: usize) -> Option<(Small, f64)> {
    let n = b.len();
    let mut diagonal = zeros(p);
    for j in 0..p {
        let length = (j..n).map(|i| a[i * p + j] * a[i * p + j]).sum::<f64>().sqrt();
        let alpha = if a[j * p + j] > 0.0 { -length } else { length };
        let pivot = a[j * p + j] - alpha;
        diagonal[j] = alpha;
        // vᵀv/2 = −α·pivot for v = x − αe₁.
        let half_square = -alpha * pivot;
        if half_square == 0.0 {
            return None;
        }
        a[j * p + j] = pivot;
        for column in j + 1..p {
            let along = (j..n).map(|i| a[i * p + j] * a[i * p + column]).sum::<f64>() / half_square;
            (j..n).for_each(|i| a[i * p + column] -= along * a[i * p + j]);
        }
        let along = (j..n).map(|i| a[i * p + j] * b[i]).sum::<f64>() / half_square;
        (j..n).for_each(|i| b[i] -= along * a[i * p + j]);
    }
    let largest = diagonal.iter().fold(0.0, |m: f64, r| m.max(r.abs()));
    if diagonal.iter().any(|r| r.abs() <= RANK_TOLERANCE * largest) {
        return None;
    }
    let mut c = Small::from_slice(&b[..p]);
    for j in (0..p).rev() {
        let known: f64 = (j + 1..p).map(|column| a[j * p + column] * c[column]).sum();
        c[j] = (c[j] - known) / diagonal[j];
    }
    Some((c, b[p..].iter().map(|r| r * r).sum()))
}
