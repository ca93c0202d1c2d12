//! Calls of the experiments into the library.

pub use gramian_numerics::kernel::{Family, Kernel};
use gramian_numerics::observer::Unobserved;
use gramian_numerics::operators;
pub use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::regression::function::interpolant::Interpolant;
use gramian_numerics::regression::function::posterior;
use gramian_numerics::regression::sums::jets::{JetOrder, Jets};
use gramian_numerics::surface;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};
pub use gramian_numerics::surface::geometry::{Orientation, SurfaceModel};

pub use super::common::clouds::cloud;
use super::common::fits::{self, factorize, fit};

/// The regularised Laplace kernel of the paper's tables.
pub const LAPLACE: Family = Family::Laplace { epsilon: 1.0 };
/// The Gauss kernel exp(−|x|²).
pub const GAUSS: Family = Family::Gauss;

/// A cloud with its signature function u_X.
pub struct Surface {
    surface: surface::Surface,
    model: SurfaceModel,
}

impl Surface {
    /// Fits the constant 1 with ℓ = 1. Answers are those of the signature function alone, as in the paper.
    pub fn of(cloud: &Cloud, family: Family, alpha: f64) -> Self {
        Self::with_model(cloud, family, alpha, SurfaceModel::Signature)
    }

    /// Fits the constant 1 with ℓ = 1. Answers are those of the given model.
    pub fn with_model(cloud: &Cloud, family: Family, alpha: f64, model: SurfaceModel) -> Self {
        // The paper's kernels have length scale 1 and variance 1.
        let factor = factorize(cloud, fits::kernel(family, 1.0), alpha);
        Self { surface: fits::surface(&factor), model }
    }

    /// The points.
    pub fn cloud(&self) -> &Cloud {
        self.surface.cloud()
    }

    /// u at the queries.
    pub fn levels(&self, queries: &Cloud) -> Vec<f64> {
        self.jets(queries, JetOrder::Value).values()
    }

    /// ∇u at the queries.
    pub fn gradients(&self, queries: &Cloud) -> Vec<Vec<f64>> {
        let jets = self.jets(queries, JetOrder::Gradient);
        (0..jets.n_queries()).map(|query| jets.gradient(query).to_vec()).collect()
    }

    /// The mean ū of u over the cloud: the level of the surface at α > 0.
    pub fn mean_level(&self) -> f64 {
        let levels = self.levels(self.cloud());
        levels.iter().sum::<f64>() / levels.len() as f64
    }

    /// Outward normals, `None` where the gradient vanishes.
    pub fn normals(&self, queries: &Cloud) -> Vec<Option<Vec<f64>>> {
        let geometry = self.geometry(queries, Orientation::Outward);
        let normal = |query: usize| (!geometry.is_null()[query]).then(|| geometry.normal(query).to_vec());
        (0..geometry.n_queries()).map(normal).collect()
    }

    /// Principal curvatures, ascending by value, `None` where the gradient vanishes.
    pub fn curvatures(&self, queries: &Cloud, orientation: Orientation) -> Vec<Option<Vec<f64>>> {
        let geometry = self.geometry(queries, orientation);
        let principal = geometry.curvatures(&Unobserved).unwrap().principal;
        let flags = geometry.is_null().iter();
        flags
            .zip(principal.chunks(geometry.dimension() - 1))
            .map(|(&flag, k)| (!flag).then(|| k.to_vec()))
            .collect()
    }

    /// The interpolant of values at the points of the cloud.
    pub fn function(&self, values: &[f64]) -> Function<'_> {
        Function { surface: self, interpolant: fit(&self.surface.signature().unwrap().solver, values) }
    }

    fn jets(&self, queries: &Cloud, order: JetOrder) -> Jets {
        self.surface.signature().unwrap().at(queries, order, &Unobserved).unwrap()
    }

    fn geometry(&self, queries: &Cloud, orientation: Orientation) -> Geometry {
        let request = GeometryRequest {
            orientation,
            model: self.model,
            checks_curvatures: self.model == SurfaceModel::Auto,
            max_offsets: usize::MAX,
            has_deviations: false,
            has_edge_normals: false,
        };
        Geometry::of(&self.surface, queries, &request, &Unobserved).unwrap()
    }
}

/// The interpolant of values on a surface.
pub struct Function<'a> {
    surface: &'a Surface,
    interpolant: Interpolant,
}

impl Function<'_> {
    /// Values of f at the queries, `[m]`.
    pub fn values(&self, queries: &Cloud) -> Vec<f64> {
        self.interpolant.at(queries, JetOrder::Value, &Unobserved).unwrap().values()
    }

    /// Surface gradients ∇_M f, `[m, d]`, and Laplace–Beltrami Δ_M f, `[m]`.
    pub fn surface_derivatives(&self, queries: &Cloud) -> (Vec<f64>, Vec<f64>) {
        let geometry = self.surface.geometry(queries, Orientation::Outward);
        assert!(geometry.flags().is_empty());
        let gradients =
            operators::Operator::SurfaceGradient.apply(&geometry, &self.interpolant, queries, &Unobserved);
        let laplacians =
            operators::Operator::LaplaceBeltrami.apply(&geometry, &self.interpolant, queries, &Unobserved);
        (gradients.unwrap(), laplacians.unwrap())
    }
}

/// Posterior means and variances of the latent function at the queries.
pub fn posterior(
    cloud: &Cloud,
    kernel: Kernel,
    noise_variance: f64,
    values: &[f64],
    queries: &Cloud,
) -> (Vec<f64>, Vec<f64>) {
    let factor = factorize(cloud, kernel, noise_variance);
    let variances = posterior::variances(&factor, queries, &Unobserved).unwrap().latent;
    let mean = fit(&factor, values);
    (mean.at(queries, JetOrder::Value, &Unobserved).unwrap().values(), variances)
}
