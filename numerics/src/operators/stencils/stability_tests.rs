//! Tests of the spectrum of the square matrix, and of the accuracy that stability costs.

use faer::Mat;
use faer::linalg::solvers::Solve;

use super::tests::{Operators, operators};
use super::*;
use crate::testing::Random;

/// Points of each cloud. Eigenvalues of as many take a second or two.
const N: usize = 500;

/// Samples n points of the unit sphere. The density below the equator is a sixteenth of that above.
fn two_densities(n: usize, random: &mut Random) -> Cloud {
    let mut points = Vec::with_capacity(3 * n);
    while points.len() < 3 * n {
        let x = random.on_sphere();
        if x[2] > 0.0 || random.uniform() < 1.0 / 16.0 {
            points.extend(x);
        }
    }
    Cloud::new(points, 3).unwrap()
}

fn random_sphere(n: usize, random: &mut Random) -> Cloud {
    Cloud::new((0..n).flat_map(|_| random.on_sphere()).collect(), 3).unwrap()
}

fn random_torus(n: usize, random: &mut Random) -> Cloud {
    let mut points = Vec::with_capacity(3 * n);
    while points.len() < 3 * n {
        let (u, v) = (random.angle(), random.angle());
        let r = 1.0 + 0.4 * v.cos();
        if random.uniform() < r / 1.4 {
            points.extend([r * u.cos(), r * u.sin(), 0.4 * v.sin()]);
        }
    }
    Cloud::new(points, 3).unwrap()
}

fn ellipsoid(n: usize, random: &mut Random) -> Cloud {
    let point = |random: &mut Random| {
        let [x, y, z] = random.on_sphere();
        [x, 0.7 * y, 0.4 * z]
    };
    Cloud::new((0..n).flat_map(|_| point(random)).collect(), 3).unwrap()
}

fn random_circle(n: usize, random: &mut Random) -> Cloud {
    let point = |angle: f64| [angle.cos(), angle.sin()];
    Cloud::new((0..n).flat_map(|_| point(random.angle())).collect(), 2).unwrap()
}

/// Samples half a sphere. At its rim no consistent row has a negative diagonal.
fn half_sphere(n: usize, random: &mut Random) -> Cloud {
    let point = |random: &mut Random| {
        let [x, y, z] = random.on_sphere();
        [x, y, z.abs()]
    };
    Cloud::new((0..n).flat_map(|_| point(random)).collect(), 3).unwrap()
}

/// Samples every point of a sphere twice, the second one slightly beside the first.
fn near_duplicates(n: usize, random: &mut Random) -> Cloud {
    let once = random_sphere(n / 2, random);
    let beside: Vec<f64> = once.coordinates().iter().map(|x| x + 1e-5 * random.normal()).collect();
    Cloud::new([once.coordinates(), &beside].concat(), 3).unwrap()
}

type Sample = fn(usize, &mut Random) -> Cloud;

const CLOUDS: [(&str, Sample); 7] = [
    ("sphere", random_sphere),
    ("torus", random_torus),
    ("two densities", two_densities),
    ("ellipsoid", ellipsoid),
    ("circle", random_circle),
    ("half a sphere", half_sphere),
    ("near duplicates", near_duplicates),
];

fn dense(matrix: &SparseMatrix) -> Mat<f64> {
    let n = matrix.indptr.len() - 1;
    let mut dense = Mat::zeros(n, n);
    for row in 0..n {
        for at in matrix.indptr[row] as usize..matrix.indptr[row + 1] as usize {
            dense[(row, matrix.indices[at] as usize)] = matrix.data[at];
        }
    }
    dense
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |a, b| a.max(b.abs()))
}

/// Returns the largest max norm during so many steps `u ← (I − τA)⁻¹u`, over that of the random values at the
/// start.
fn growth(matrix: &Mat<f64>, step: f64, n_steps: usize) -> f64 {
    let n = matrix.nrows();
    let identity = |i: usize, j: usize| f64::from(u8::from(i == j));
    let factor = Mat::from_fn(n, n, |i, j| identity(i, j) - step * matrix[(i, j)]).partial_piv_lu();
    let mut random = Random(77);
    let mut u = Mat::from_fn(n, 1, |_, _| 2.0 * random.uniform() - 1.0);
    let norm = |u: &Mat<f64>| largest((0..n).map(|i| u[(i, 0)]));
    let (start, mut most) = (norm(&u), 0.0);
    for _ in 0..n_steps {
        u = factor.solve(&u);
        most = f64::max(most, norm(&u));
    }
    most / start
}

#[test]
fn no_eigenvalue_has_a_positive_real_part_and_no_row_is_empty() {
    for (name, sample) in CLOUDS {
        for seed in 1..3 {
            let stencils = operators(&sample(N, &mut Random(seed))).stable;
            assert_eq!(stencils.n_rows(RowKind::Empty), 0, "{name} {seed}");
            let eigenvalues = dense(&stencils.matrix).eigenvalues().unwrap();
            let radius = eigenvalues.iter().fold(0.0, |a: f64, z| a.max(z.norm()));
            let rightmost = eigenvalues.iter().fold(f64::NEG_INFINITY, |a, z| a.max(z.re));
            assert!(rightmost < 1e-8 * radius, "{name} {seed}: {rightmost:e} of {radius:e}");
        }
    }
}

#[test]
fn a_thousand_steps_of_backward_euler_do_not_grow() {
    for (name, sample) in CLOUDS {
        let stencils = operators(&sample(N, &mut Random(3))).stable;
        let matrix = dense(&stencils.matrix);
        for step in [1e-3, 1e-2] {
            let found = growth(&matrix, step, 1000);
            assert!(found < 1.05, "{name} {step}: {found}");
        }
    }
}

#[test]
fn stable_rows_are_nearly_as_accurate_as_interpolation() {
    // xyz is a harmonic of degree 3: Δ = −12. The numbers are medians of the errors of interpolating splines:
    // RBF-FD without smoothing, nodes within a tenth of a spacing left out. These leave eigenvalues with
    // positive real part.
    let interpolated =
        [("sphere", [8.95e-5, 8.30e-5, 8.54e-5]), ("two densities", [2.98e-5, 3.00e-5, 2.95e-5])];
    for (name, before) in interpolated {
        let sample: Sample = if name == "sphere" { random_sphere } else { two_densities };
        for (seed, before) in (1..).zip(before) {
            let cloud = sample(1000, &mut Random(seed));
            let stencils = operators(&cloud).stable;
            let values: Vec<f64> = cloud.points().map(|x| x[0] * x[1] * x[2]).collect();
            let found = stencils.matrix.apply(&values);
            let mut errors: Vec<f64> = found.iter().zip(&values).map(|(f, v)| (f + 12.0 * v).abs()).collect();
            errors.sort_by(f64::total_cmp);
            assert!(errors[500] < 2.0 * before, "{name} {seed}: {:e} {before:e}", errors[500]);
        }
    }
}

#[test]
fn kinds_of_rows_are_told_apart() {
    let Operators { stable: stencils, gradient, .. } = operators(&two_densities(1000, &mut Random(1)));
    let count = |kind| stencils.n_rows(kind);
    assert!(count(RowKind::Nearest) > 900 && count(RowKind::Graded) > 10, "{:?}", stencils.kinds);
    assert_eq!(gradient.n_rows(RowKind::Nearest), 1000);
    let stencils = operators(&half_sphere(1000, &mut Random(1))).stable;
    assert!(stencils.n_rows(RowKind::Positive) > 10, "{:?}", stencils.kinds);
    // Positive rows add up to 0, and all entries but the diagonal are at least 0.
    let matrix = &stencils.matrix;
    let positive = (0..1000).filter(|&row| stencils.kinds[row] == RowKind::Positive);
    for row in positive {
        let range = matrix.indptr[row] as usize..matrix.indptr[row + 1] as usize;
        let (columns, weights) = (&matrix.indices[range.clone()], &matrix.data[range]);
        let sum: f64 = weights.iter().sum();
        assert!(sum.abs() < 1e-12 * largest(weights.iter().copied()));
        assert!(columns.iter().zip(weights).all(|(&column, &w)| w >= 0.0 || column == row as i64));
    }
}
