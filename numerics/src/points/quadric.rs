//! Least-squares quadrics through the nearest points.
//!
//! They are a second opinion on normals and curvatures without kernel or length scale: they use nothing but
//! the positions of a few neighbours.

use smallvec::SmallVec;

use super::patch::Patch;
use crate::machine::small::{Small, zeros};

/// Storage of a least-squares problem, on the stack for a surface in space.
type Columns = SmallVec<[f64; 128]>;

/// Neighbours per coefficient of a quadric: 18 neighbours for surfaces in space.
const NEIGHBOURS_PER_COEFFICIENT: usize = 3;

/// Least diagonal entry of R relative to the largest. Below it, the neighbours do not determine a quadric.
const RANK_TOLERANCE: f64 = 1e-6;

/// Number of coefficients of a quadric over d − 1 tangential coordinates: `d(d+1)/2`.
pub(crate) fn n_coefficients(dimension: usize) -> usize {
    dimension * (dimension + 1) / 2
}

/// Default number of neighbours that a quadric is fitted to.
pub(crate) fn n_quadric_neighbours(dimension: usize) -> usize {
    NEIGHBOURS_PER_COEFFICIENT * n_coefficients(dimension)
}

/// A quadric `z = height + slope·t + ½ tᵀ hessian t` in the frame and scale of a patch.
pub(crate) struct Quadric {
    pub height: f64,
    /// Gradient at t = 0, `[d−1]`.
    pub slope: Small,
    /// Second derivatives, `[d−1, d−1]`.
    pub hessian: Small,
    /// Root mean square residual, corrected for the degrees of freedom.
    pub residual: f64,
    /// Triangular factor R of AᵀA = RᵀR, where A holds the terms at the points: upper triangle, `[p, p]`.
    factor: Columns,
}

impl Quadric {
    /// Fits the heights over the tangential coordinates by least squares. Returns `None` if the points do not
    /// determine a quadric.
    pub(crate) fn of(patch: &Patch) -> Option<Self> {
        let d = patch.dimension();
        let (k, p) = (d - 1, n_coefficients(d));
        let n = patch.n_points();
        if n < p {
            return None;
        }
        // The columns are 1, the tangential coordinates, and their products.
        let mut columns = Columns::from_elem(1.0, n * p);
        let (linear, products) = columns[n..].split_at_mut(k * n);
        let coordinate = |axis| patch.coordinates().iter().skip(axis).step_by(d);
        for (axis, column) in linear.chunks_exact_mut(n).enumerate() {
            column.iter_mut().zip(coordinate(axis)).for_each(|(slot, t)| *slot = *t);
        }
        let mut products = products.chunks_exact_mut(n);
        for (a, left) in linear.chunks_exact(n).enumerate() {
            for ((b, right), column) in linear.chunks_exact(n).enumerate().skip(a).zip(&mut products) {
                let factor = if a == b { 0.5 } else { 1.0 };
                let both = left.iter().zip(right);
                column.iter_mut().zip(both).for_each(|(slot, (l, r))| *slot = factor * l * r);
            }
        }
        let mut heights: Columns = coordinate(k).copied().collect();
        let (coefficients, squared_residual, factor) = least_squares(&mut columns, &mut heights, p)?;
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
            factor,
        })
    }

    /// Standard error of the second derivative `vᵀHv` along a unit vector v, `[d−1]`, by `(AᵀA)⁻¹`. It takes
    /// the residual to be noise.
    pub(crate) fn standard_error(&self, v: &[f64]) -> f64 {
        let (k, p) = (v.len(), n_coefficients(v.len() + 1));
        let mut form = zeros(p);
        let mut at = k + 1;
        for a in 0..k {
            for b in a..k {
                form[at] = v[a] * v[b] * if a == b { 1.0 } else { 2.0 };
                at += 1;
            }
        }
        for j in 0..p {
            let known: f64 = (0..j).map(|i| self.factor[i * p + j] * form[i]).sum();
            form[j] = (form[j] - known) / self.factor[j * p + j];
        }
        self.residual * form.iter().map(|w| w * w).sum::<f64>().sqrt()
    }
}

/// Minimises `|Ac − b|` by Householder reflections in place (Golub and Van Loan 2013, sec. 5.2.2).
///
/// A is `[n, p]`, column by column. Returns c, the squared residual and R, or `None` if A does not have full
/// rank.
fn least_squares(a: &mut [f64], b: &mut [f64], p: usize) -> Option<(Small, f64, Columns)> {
    let n = b.len();
    let mut diagonal = zeros(p);
    for j in 0..p {
        let (left, right) = a.split_at_mut((j + 1) * n);
        let reflector = &mut left[j * n + j..];
        let length = long_dot(reflector, reflector).sqrt();
        let alpha = if reflector[0] > 0.0 { -length } else { length };
        reflector[0] -= alpha;
        diagonal[j] = alpha;
        // vᵀv/2 = −α·pivot for v = x − αe₁.
        let half_square = -alpha * reflector[0];
        if half_square == 0.0 {
            return None;
        }
        for column in right.chunks_exact_mut(n).chain([&mut *b]) {
            let along = long_dot(reflector, &column[j..]) / half_square;
            column[j..].iter_mut().zip(&*reflector).for_each(|(x, v)| *x -= along * v);
        }
    }
    let largest = diagonal.iter().fold(0.0, |m: f64, r| m.max(r.abs()));
    if diagonal.iter().any(|r| r.abs() <= RANK_TOLERANCE * largest) {
        return None;
    }
    let mut c = Small::from_slice(&b[..p]);
    for j in (0..p).rev() {
        let known: f64 = (j + 1..p).map(|column| a[column * n + j] * c[column]).sum();
        c[j] = (c[j] - known) / diagonal[j];
    }
    let mut factor = Columns::from_elem(0.0, p * p);
    for j in 0..p {
        (0..j).for_each(|i| factor[i * p + j] = a[j * n + i]);
        factor[j * p + j] = diagonal[j];
    }
    Some((c, b[p..].iter().map(|r| r * r).sum(), factor))
}

/// Scalar product in four independent sums, none of which waits for the others.
fn long_dot(a: &[f64], b: &[f64]) -> f64 {
    let (fours_a, rest_a) = a.as_chunks::<4>();
    let (fours_b, rest_b) = b.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (x, y) in fours_a.iter().zip(fours_b) {
        for lane in 0..4 {
            sums[lane] += x[lane] * y[lane];
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(x, y)| x * y).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}
