//! Curvatures of every shape, kernel, size and sampling against exact ones, with
//! counts of wrong ones and flags.

use std::sync::Arc;

use gramian_numerics::kernel::defaults::Purpose;
use gramian_numerics::kernel::{Family, WendlandSmoothness};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::flags::FlagReason;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest, SurfaceModel};
use gramian_numerics::surface::local::{LocalInputs, LocalSurface};
use gramian_numerics::surface::served::ServedBy;

use super::common::clouds::cloud;
use super::common::fits::{default_kernel_and_alpha, factorize, kernel, surface};
use super::common::random::Random;
use super::shapes::Shape;

/// Seven kernels, each with the length scale at which it is about as wide as the Gauss kernel with ℓ = 1.
pub const KERNELS: [(&str, Family, f64); 7] = [
    ("gauss", Family::Gauss, 1.0),
    ("laplace, epsilon 1", Family::Laplace { epsilon: 1.0 }, 1.0),
    ("laplace, epsilon 0.01", Family::Laplace { epsilon: 0.01 }, 1.0),
    ("matern 3/2", Family::Matern { order: 1 }, 1.0),
    ("matern 5/2", Family::Matern { order: 2 }, 1.0),
    ("wendland 4", Family::Wendland { smoothness: WendlandSmoothness::C4 }, 3.0),
    ("inverse multiquadric", Family::InverseMultiquadric, 1.0),
];

pub const SIZES: [usize; 3] = [100, 300, 1000];

/// A shape, its sampling, and a kernel.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    pub shape: Shape,
    pub kernel: (&'static str, Family, f64),
    pub n_points: usize,
    pub is_random: bool,
}

/// Counts of answers by accuracy and flag.
#[derive(Debug, Clone, Copy, Default)]
pub struct Tally {
    pub queries: usize,
    pub null: usize,
    pub flagged: usize,
    pub offset: usize,
    /// Answers without a flag that are off by more than 10 %.
    pub missed_10: usize,
    pub missed_50: usize,
    /// Flagged answers that are off by more than 50 %.
    pub caught_50: usize,
    /// Flagged answers that are right to 10 %.
    pub false_alarms: usize,
    /// Greatest error of an answer without a flag.
    pub worst: f64,
}

impl Tally {
    pub fn add(mut self, other: Self) -> Self {
        self.queries += other.queries;
        self.null += other.null;
        self.flagged += other.flagged;
        self.offset += other.offset;
        self.missed_10 += other.missed_10;
        self.missed_50 += other.missed_50;
        self.caught_50 += other.caught_50;
        self.false_alarms += other.false_alarms;
        self.worst = self.worst.max(other.worst);
        self
    }

    pub fn unflagged(&self) -> usize {
        self.queries - self.null - self.flagged
    }
}

pub fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for shape in super::shapes::SHAPES {
        for kernel in KERNELS {
            for n_points in SIZES {
                for is_random in [false, true] {
                    cases.push(Case { shape, kernel, n_points, is_random });
                }
            }
        }
    }
    cases
}

impl Case {
    /// Counts answers at 60 points of the cloud and at 60 other points of the surface.
    pub fn run(&self, model: SurfaceModel, scale: f64) -> Tally {
        let (points, mut random) = self.sample();
        let factor = factorize(&cloud(&points), kernel(self.kernel.1, self.kernel.2 * scale), 1e-10);
        let Ok(signature) = Interpolant::signature(factor, &Unobserved) else {
            return Tally::default();
        };
        let surface = Surface::of(signature, None, &Unobserved).unwrap();
        let step = points.len().div_ceil(60);
        let mut queries: Vec<[f64; 3]> = points.iter().copied().step_by(step).collect();
        queries.extend(self.shape.sample(60, Some(&mut random)));
        let request = GeometryRequest { model, ..GeometryRequest::CURVATURES };
        self.tally(&surface, &cloud(&queries), &queries, &request)
    }

    /// Counts answers at the points of the noisy cloud, twice: curvatures of the default kernel, confirmed by
    /// T3 and T4, and curvatures of local regressions with their deviations.
    pub fn run_with_noise(&self, noise: f64) -> [Tally; 2] {
        let (points, mut random) = self.sample();
        let moved = points.iter().map(|x| x.map(|x| x + noise * random.normal())).collect::<Vec<_>>();
        let noisy = Arc::new(cloud(&moved));
        let (kernel, alpha) = default_kernel_and_alpha(&noisy, Purpose::Curvatures);
        let before = surface(&factorize(&noisy, kernel, alpha));
        let before = self.tally(&before, &noisy, &points, &GeometryRequest::CURVATURES);
        let sampling = Arc::new(Sampling::of(&noisy, &Unobserved).unwrap());
        let local = LocalSurface::of(noisy.clone(), sampling, LocalInputs::default(), &Unobserved).unwrap();
        let request = GeometryRequest { has_deviations: true, ..GeometryRequest::CURVATURES };
        [before, self.tally(&local.into(), &noisy, &points, &request)]
    }

    fn sample(&self) -> (Vec<[f64; 3]>, Random) {
        let mut random = Random(1000 + self.n_points as u64);
        (self.shape.sample(self.n_points, self.is_random.then_some(&mut random)), random)
    }

    /// Compares answers at queries with the surface at the places to which the queries belong.
    fn tally(
        &self,
        surface: &Surface,
        queries: &Cloud,
        places: &[[f64; 3]],
        request: &GeometryRequest,
    ) -> Tally {
        let geometry = Geometry::of(surface, queries, request, &Unobserved).unwrap();
        let curvatures = geometry.curvatures(&Unobserved).unwrap();
        let radius = surface.cloud().radius();
        let mut tally = Tally { queries: places.len(), ..Tally::default() };
        let mut flags = vec![None; places.len()];
        geometry.flags().iter().for_each(|entry| flags[entry.query] = Some(entry.reason));
        for (query, &x) in places.iter().enumerate() {
            let (normal, exact) = (self.shape.normal(x), self.shape.curvatures(x));
            let found = &curvatures.principal[query * 2..][..2];
            // Open shapes have no outside: compare with the curvatures for the normal that was answered.
            let along: f64 = geometry.normal(query).iter().zip(&normal).map(|(a, b)| a * b).sum();
            let is_open = matches!(self.shape, Shape::Saddle | Shape::Plane);
            let exact = if is_open && along < 0.0 { [-exact[1], -exact[0]] } else { exact };
            let largest = exact[0].abs().max(exact[1].abs()).max(0.5 / radius);
            let error = (found[0] - exact[0]).abs().max((found[1] - exact[1]).abs()) / largest;
            tally.offset += usize::from(geometry.served_by(query) == ServedBy::Offset);
            match flags[query] {
                Some(reason) if FlagReason::is_null(reason) => tally.null += 1,
                Some(_) => {
                    tally.flagged += 1;
                    tally.caught_50 += usize::from(error > 0.5);
                    tally.false_alarms += usize::from(error <= 0.1);
                }
                None => {
                    tally.missed_10 += usize::from(error.is_nan() || error > 0.1);
                    tally.missed_50 += usize::from(error.is_nan() || error > 0.5);
                    tally.worst = tally.worst.max(error);
                }
            }
        }
        tally
    }
}
