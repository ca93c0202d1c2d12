//! Operators against the time of their largest parts.
//!
//! Measured from a cold start are a Laplace–Beltrami matrix, m = n, and posterior variances, m = n/2. Each is
//! compared with a factorization and the triangular solves that it needs, by faer's own routines in warm
//! memory. The fused pass over the points is measured too.
//!
//! `cargo bench --bench operators [-- n]`, or with `--lockstep` one round for each line on standard input.

mod support;

use std::sync::Arc;
use std::time::Duration;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Mat, Par};
use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::operators::Operator;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::function::posterior::variances;
use gramian_numerics::regression::solver::trend::Mean;
use gramian_numerics::regression::solver::{Solver, System};
use gramian_numerics::regression::sums::jets::{JetOrder, Jets};
use gramian_numerics::regression::sums::regularization::Regularization;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};
use support::common::clouds::{fibonacci_sphere, turned_fibonacci_sphere};
use support::common::fits;
use support::{ROUNDS, Times, measure, size_argument, timed};

const LENGTH_SCALE: f64 = 0.2;
const ALPHA: f64 = 1e-6;

fn main() {
    let n = size_argument(2000);
    let (cloud, queries) = (Arc::new(fibonacci_sphere(n)), turned_fibonacci_sphere(n / 2, 1.0));
    let mut reference = Reference::of(&cloud);
    let bests = measure(|| {
        let (factor, factorize) = timed(|| Arc::new(factorize(&cloud)));
        let (_, matrix) = timed(|| laplace_beltrami(&factor));
        let (_, variance) = timed(|| variances(&factor, &queries, &Unobserved).unwrap());
        let passes = [("pass_gradient", JetOrder::Gradient), ("pass_hessian", JetOrder::Hessian)];
        let mut times = vec![
            ("laplace_beltrami", factorize + matrix),
            ("variances", factorize + variance),
            ("factorize", factorize),
        ];
        times.extend(passes.map(|(name, order)| (name, pass(&cloud, order))));
        times.extend(reference.times(n / 2));
        times
    });
    let Some(bests) = bests else { return };
    println!("n = {n}, {} threads, best of {ROUNDS}", rayon::current_num_threads());
    bests.print();
    let best = |part| bests.seconds(part);
    let ratio = |whole, solve| best(whole) / (best("reference_factor") + best(solve));
    println!(
        "Laplace–Beltrami matrix over factor and solves: {:.2}",
        ratio("laplace_beltrami", "reference_solve")
    );
    println!("variances over factor and forward solve: {:.2}", ratio("variances", "reference_forward"));
}

fn kernel() -> Kernel {
    Kernel::new(Family::Matern { order: 2 }, LENGTH_SCALE, 1.0).unwrap()
}

fn factorize(cloud: &Arc<Cloud>) -> Solver {
    let alpha = Regularization::uniform(ALPHA).unwrap();
    System::new(cloud.clone(), kernel(), alpha).and_then(|system| Solver::dense(system, &Unobserved)).unwrap()
}

/// The matrix at the points, with the weights, surface and geometry that it needs.
fn laplace_beltrami(factor: &Arc<Solver>) -> Vec<f64> {
    let request = GeometryRequest { max_offsets: 0, ..GeometryRequest::CURVATURES };
    let geometry = Geometry::of(&fits::surface(factor), factor.cloud(), &request, &Unobserved).unwrap();
    Operator::LaplaceBeltrami.matrix(&geometry, factor, factor.cloud(), Mean::Zero, &Unobserved).unwrap()
}

/// The time of one fused pass over n points at n queries.
fn pass(cloud: &Cloud, order: JetOrder) -> Duration {
    let weights = vec![1.0; cloud.n_points()];
    timed(|| Jets::evaluate(cloud, &kernel(), &weights, cloud, order, &Unobserved).unwrap()).1
}

/// Buffers of the reference computations, used again in every round.
struct Reference {
    matrix: Mat<f64>,
    factor: Mat<f64>,
    columns: Mat<f64>,
    scratch: MemBuffer,
    par: Par,
}

impl Reference {
    /// Fills the matrix by the kernel's formula `φ = (1 + s + s²/3) e^{−s}`, `s = √5 |x − y|/ℓ`.
    fn of(cloud: &Cloud) -> Self {
        let n = cloud.n_points();
        let matrix = Mat::from_fn(n, n, |i, j| {
            let squared: f64 = cloud.point(i).iter().zip(cloud.point(j)).map(|(a, b)| (a - b).powi(2)).sum();
            let s = (5.0 * squared).sqrt() / LENGTH_SCALE;
            (1.0 + s + s * s / 3.0) * (-s).exp() + if i == j { ALPHA } else { 0.0 }
        });
        let par = Par::rayon(rayon::current_num_threads());
        let scratch = MemBuffer::new(cholesky_in_place_scratch::<f64>(n, par, Default::default()));
        let columns = Mat::from_fn(n, n, |i, j| ((i + 3 * j) % 11) as f64 - 5.0);
        Self { factor: matrix.clone(), matrix, columns, scratch, par }
    }

    /// Times of a factorization, a solve with n columns, and a forward solve with `n_forward` columns.
    fn times(&mut self, n_forward: usize) -> Times {
        self.factor.copy_from(&self.matrix);
        let stack = MemStack::new(&mut self.scratch);
        let factor = self.factor.as_mut();
        let (outcome, factorization) =
            timed(|| cholesky_in_place(factor, Default::default(), self.par, stack, Default::default()));
        outcome.unwrap();
        let lower = self.factor.as_ref();
        let mut columns = self.columns.clone();
        let (_, solve) = timed(|| {
            solve_lower_triangular_in_place(lower, columns.as_mut(), self.par);
            solve_upper_triangular_in_place(lower.transpose(), columns.as_mut(), self.par);
        });
        let some = columns.as_mut().subcols_mut(0, n_forward);
        let (_, forward) = timed(|| solve_lower_triangular_in_place(lower, some, self.par));
        vec![("reference_factor", factorization), ("reference_solve", solve), ("reference_forward", forward)]
    }
}
