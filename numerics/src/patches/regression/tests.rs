//! Kriging in lanes against its formulas, written out for one query, with derivatives by differences.

use super::doubt::Doubt;
use super::*;
use crate::kernel::Family;
use crate::machine::instruction_set::InstructionSet;
use crate::testing::Random;

const N: usize = 22;
const P: usize = n_terms(3);
/// Terms of fourth order and less.
const QUARTIC: usize = 15;
const LENGTH_SCALE: f64 = 0.8;
const NOISE: f64 = 0.01;

/// Points of one neighbourhood.
struct Points {
    places: [[f64; 2]; N],
    heights: [f64; N],
    entailed: [f64; N],
    weights: [f64; N],
}

impl Points {
    fn random(seed: u64) -> Self {
        let mut random = Random(seed);
        let mut uniform = || 2.0 * random.uniform() - 1.0;
        let places = [(); N].map(|()| [uniform(), uniform()]);
        let heights =
            places.map(|[s, t]| 0.1 + 0.3 * s - 0.4 * s * t + 0.2 * (3.0 * s).sin() + 0.05 * uniform());
        let entailed = places.map(|[s, t]| 0.02 * (s * s + t * t).powi(2));
        let weights = [(); N].map(|()| if uniform() > 0.0 { 1.0 } else { 0.25 });
        Self { places, heights, entailed, weights }
    }

    /// The first M of the terms up to fourth order.
    fn terms<const M: usize>(&self, j: usize) -> [f64; M] {
        let [s, t] = self.places[j];
        let quadric = [1.0, s, t, 0.5 * s * s, s * t, 0.5 * t * t];
        let beyond = [(3, 0), (4, 0), (3, 1), (2, 1), (2, 2), (1, 2), (1, 3), (0, 3), (0, 4)];
        let of = |(a, b): (i32, i32)| s.powi(a) * t.powi(b);
        std::array::from_fn(|i| if i < P { quadric[i] } else { of(beyond[i - P]) })
    }

    /// Makes a batch with this neighbourhood in all lanes and `n_empty` empty places at the end.
    fn batch(&self, lanes: usize, n_empty: usize) -> Batch {
        let mut batch = Batch::new(3, N + n_empty, lanes);
        for lane in 0..lanes {
            for j in 0..N {
                batch.set_point(j, lane, true);
                batch.set_coordinate(0, j, lane, self.places[j][0]);
                batch.set_coordinate(1, j, lane, self.places[j][1]);
                batch.set_coordinate(2, j, lane, self.heights[j]);
                batch.set_entailed(j, lane, self.entailed[j]);
                batch.set_weight(j, lane, self.weights[j]);
                (0..3).for_each(|term| batch.set_product(term, j, lane, self.terms::<P>(j)[3 + term]));
            }
            batch.keep(lane, N);
        }
        batch
    }
}

/// Matérn's kernel of ν = 9/2 between two places (Rasmussen and Williams 2006, eq. 4.16).
fn matern(x: [f64; 2], y: [f64; 2]) -> f64 {
    let r = 3.0 * (x[0] - y[0]).hypot(x[1] - y[1]) / LENGTH_SCALE;
    (-r).exp() * (1.0 + r + 3.0 / 7.0 * r * r + 2.0 / 21.0 * r.powi(3) + r.powi(4) / 105.0)
}

/// Value, first and second derivatives of f at 0 by central differences, in the order of the terms.
fn derivatives(f: impl Fn([f64; 2]) -> f64) -> [f64; P] {
    const H: f64 = 1e-3;
    let at = |s: f64, t: f64| f([s * H, t * H]);
    let second = |a: f64, b: f64| (a + b - 2.0 * at(0.0, 0.0)) / (H * H);
    let mixed = at(1.0, 1.0) - at(1.0, -1.0) - at(-1.0, 1.0) + at(-1.0, -1.0);
    [
        at(0.0, 0.0),
        (at(1.0, 0.0) - at(-1.0, 0.0)) / (2.0 * H),
        (at(0.0, 1.0) - at(0.0, -1.0)) / (2.0 * H),
        second(at(1.0, 0.0), at(-1.0, 0.0)),
        mixed / (4.0 * H * H),
        second(at(0.0, 1.0), at(0.0, -1.0)),
    ]
}

/// A⁻¹ and ln det A of a positive definite matrix, by Gauss and Jordan.
fn inverse<const M: usize>(mut a: [[f64; M]; M]) -> ([[f64; M]; M], f64) {
    let mut right = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
    let mut log_determinant = 0.0;
    for i in 0..M {
        let pivot: f64 = a[i][i];
        log_determinant += pivot.ln();
        (a[i], right[i]) = (a[i].map(|x| x / pivot), right[i].map(|x| x / pivot));
        for other in (0..M).filter(|&other| other != i) {
            let factor = a[other][i];
            for column in 0..M {
                a[other][column] -= factor * a[i][column];
                right[other][column] -= factor * right[i][column];
            }
        }
    }
    (right, log_determinant)
}

fn times<const M: usize>(a: &[[f64; M]; M], x: &[f64; M]) -> [f64; M] {
    a.map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum())
}

fn dot<const M: usize>(x: &[f64; M], y: &[f64; M]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

/// Expected [`ModelResult`], by the formulas, with M terms of the trend.
fn written_out<const M: usize>(points: &Points) -> ModelResult {
    let covariance = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let noise = if i == j { NOISE * points.weights[i] + 1e-13 } else { 0.0 };
            matern(points.places[i], points.places[j]) + noise
        })
    });
    let (inverse_k, log_k) = inverse::<N>(covariance);
    let trend: [[f64; N]; M] = std::array::from_fn(|i| std::array::from_fn(|j| points.terms::<M>(j)[i]));
    let solved = trend.map(|column| times(&inverse_k, &column));
    let gram = std::array::from_fn(|i| std::array::from_fn(|j| dot(&trend[i], &solved[j])));
    let (inverse_a, log_a) = inverse::<M>(gram);
    // Coefficients of the trend for y, and K⁻¹ times the residual of y.
    let fit = |y: &[f64; N]| {
        let coefficients = times(&inverse_a, &solved.map(|column| dot(&column, y)));
        let rest = std::array::from_fn(|j| y[j] - dot(&points.terms::<M>(j), &coefficients));
        (coefficients, times(&inverse_k, &rest))
    };
    let (beta_z, rest_z) = fit(&points.heights);
    let (beta_e, rest_e) = fit(&points.entailed);
    let freedom = (N - M) as f64;
    let doubt = Doubt::of(
        dot(&points.heights, &rest_z),
        dot(&points.entailed, &rest_z),
        dot(&points.entailed, &rest_e),
        freedom,
    );
    let by_point = points.places.map(|t| derivatives(|x| matern(x, t)));
    let cross: [[f64; N]; P] = std::array::from_fn(|i| std::array::from_fn(|j| by_point[j][i]));
    let mean = |i: usize, beta: &[f64; M], rest: &[f64; N]| beta[i] + dot(&cross[i], rest);
    let effect: [f64; P] = std::array::from_fn(|i| mean(i, &beta_e, &rest_e));
    let unexplained: [[f64; M]; P] = std::array::from_fn(|i| {
        std::array::from_fn(|l| f64::from(u8::from(i == l)) - dot(&solved[l], &cross[i]))
    });
    let scale = doubt.quadratic / freedom;
    let prior = model::prior_covariance(&model(Trend::Quadric), 2);
    let entry = |i: usize, j: usize| {
        let explained = dot(&cross[i], &times(&inverse_k, &cross[j]));
        let of_trend = dot(&unexplained[i], &times(&inverse_a, &unexplained[j]));
        scale * (prior[i * P + j] - explained + of_trend) + doubt.variance * effect[i] * effect[j]
    };
    ModelResult {
        log_likelihood: -0.5 * (log_k + log_a + freedom * doubt.quadratic.ln()) - doubt.log_penalty,
        scale,
        freedom,
        means: (0..P).map(|i| mean(i, &beta_z, &rest_z) - doubt.mean * effect[i]).collect(),
        covariance: (0..P * P).map(|at| entry(at / P, at % P)).collect(),
    }
}

fn model(trend: Trend) -> Model {
    Model { family: Family::Matern { order: 4 }, length_scale: LENGTH_SCALE, noise: NOISE, trend }
}

#[test]
fn lanes_say_what_the_formulas_say() {
    let set = InstructionSet::best();
    for seed in 0..10 {
        let points = Points::random(seed);
        let (trend, expected) = match seed % 2 {
            0 => (Trend::Quadric, written_out::<P>(&points)),
            _ => (Trend::Quartic, written_out::<QUARTIC>(&points)),
        };
        let model = model(trend);
        for n_empty in [0, 4] {
            let batch = points.batch(set.n_lanes(), n_empty);
            let mut workspace = workspace(3, N + n_empty);
            let krige = Krige { batch: &batch, model: &model, workspace: &mut workspace, predicts: true };
            for found in set.dispatch(krige) {
                assert!((found.log_likelihood - expected.log_likelihood).abs() < 1e-8, "{seed}");
                assert!((found.scale / expected.scale - 1.0).abs() < 1e-8, "{seed}");
                assert_eq!(found.freedom, expected.freedom);
                // Second differences with steps of 1e-3 leave errors of 1e-6 of fourth derivatives, which are
                // in the hundreds.
                for (x, y) in found.means.iter().zip(&expected.means) {
                    assert!((x - y).abs() < 1e-3, "{seed}: {:?} against {:?}", found.means, expected.means);
                }
                for (x, y) in found.covariance.iter().zip(&expected.covariance) {
                    assert!((x - y).abs() < 1e-3 * (1.0 + y.abs()), "{seed}: {x} against {y}");
                }
            }
        }
    }
}

#[test]
fn prior_covariances_are_derivatives_of_the_kernel() {
    let prior = model::prior_covariance(&model(Trend::Quadric), 2);
    // Derivative ∂_i in x and ∂_j in y of k(x, y) at 0: differences of differences.
    for i in 0..P {
        let row = derivatives(|y| derivatives(|x| matern(x, y))[i]);
        for (j, expected) in row.into_iter().enumerate() {
            let found = prior[i * P + j];
            // Differences of fourth order with steps of 1e-3 lose 1e-16/1e-12 by rounding, and as much by the
            // sixth derivatives.
            assert!(
                (found - expected).abs() < 2e-3 * (1.0 + found.abs()),
                "{i}, {j}: {found} against {expected}"
            );
        }
    }
}
