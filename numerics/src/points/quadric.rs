//! Quadrics through the nearest points.
//!
//! A second opinion on normals and curvatures that knows neither kernel nor length scale: it sees the positions of a few
//! neighbours and nothing else.

use smallvec::SmallVec;

use super::patch::Patch;
use crate::machine::small::{Small, zeros};

/// The numbers of a least-squares problem, on the stack for a surface in space.
type Columns = SmallVec<[f64; 128]>;

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
    /// R of AᵀA = RᵀR, A the terms at the points: upper triangle, `[p, p]`.
    factor: Columns,
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
        // 1, the tangential coordinates, their products.
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

    /// Standard error of the second derivative along a unit vector v, `[d−1]`, if the residual is noise: that of `vᵀHv` by `(AᵀA)⁻¹`.
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

/// Minimises `|Ac − b|` by Householder reflections in place (Golub and Van Loan 2013, sec. 5.2.2), A `[n, p]` column by column.
/// Answers c, the squared residual and R; `None` if A has not full rank.
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

/// A scalar product in four sums, none of which waits for the others.
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
