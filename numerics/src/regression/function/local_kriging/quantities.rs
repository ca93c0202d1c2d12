//! Quantities besides the value whose deviations are requested.

use crate::error::{NumericsError, Result};
use crate::kernel::Kernel;
use crate::machine::small::{Small, zeros};
use crate::regression::function::functionals::{JetFunctional, has_variance};
use crate::regression::solver::trend::Basis;

/// A function that returns the functionals of a query, equally many for each.
pub(crate) type Functionals<'a> = &'a (dyn Fn(usize) -> Vec<JetFunctional> + Sync);

/// The quantities besides the value whose deviations are requested.
pub(super) enum Quantities<'a> {
    /// Derivatives: identical for all queries.
    Derivatives(Vec<Derivative>),
    /// Functionals of derivatives up to `order`, `count` of them at each query.
    Functionals { of: Functionals<'a>, count: usize, order: usize },
}

/// The value or another quantity, at a query.
#[derive(Clone, Copy)]
pub(super) enum Quantity<'a> {
    Value,
    Derivative(&'a Derivative),
    Functional(&'a ScaledFunctional),
}

/// A first or second derivative of the function.
pub(super) struct Derivative {
    /// The axis of a first derivative, `None` for a second one.
    axis: Option<usize>,
    /// Prior variance of the derivative in units of ℓ.
    prior_variance: f64,
    /// Factor from a deviation in units of ℓ to one along the axes.
    unit: f64,
}

/// A functional divided by its size, so that squares do not overflow.
pub(super) struct ScaledFunctional {
    functional: JetFunctional,
    size: f64,
}

impl ScaledFunctional {
    pub(super) fn of(functional: &JetFunctional, kernel: &Kernel) -> Self {
        let size = functional.size(kernel);
        Self { functional: functional.over(size), size }
    }

    /// Returns the coefficients on derivatives in units of ℓ.
    ///
    /// First `[d]` for the gradient, then the upper triangle of the Hessian.
    pub(super) fn coefficients(&self, kernel: &Kernel) -> Small {
        self.functional.coefficients(kernel)
    }
}

impl<'a> Quantities<'a> {
    /// Returns the derivatives up to `order`: the first ones, then the upper triangle of the second ones.
    ///
    /// # Errors
    /// [`NumericsError::DerivativesVary`] if the process has no derivatives of this order.
    pub(super) fn derivatives(kernel: &Kernel, d: usize, order: usize) -> Result<Self> {
        if !has_variance(kernel, order) {
            return Err(NumericsError::DerivativesVary { order });
        }
        if order == 0 {
            return Ok(Self::none());
        }
        let ([_, slope, bend], v) = (kernel.profile_at_zero(), kernel.variance());
        let unit = |axis: usize| kernel.stretch(axis) / kernel.length_scale();
        let of_axis =
            |a: usize| Derivative { axis: Some(a), prior_variance: -2.0 * v * slope, unit: unit(a) };
        let of_pair = |(a, b): (usize, usize)| Derivative {
            axis: None,
            prior_variance: 4.0 * v * bend * if a == b { 3.0 } else { 1.0 },
            unit: unit(a) * unit(b),
        };
        let pairs = (0..d).flat_map(|a| (a..d).map(move |b| (a, b)));
        let second = pairs.map(of_pair).filter(|_| order == 2);
        Ok(Self::Derivatives((0..d).map(of_axis).chain(second).collect()))
    }

    pub(super) fn none() -> Self {
        Self::Derivatives(Vec::new())
    }

    /// Returns `count` functionals per query, of derivatives up to `order`.
    ///
    /// # Errors
    /// [`NumericsError::DerivativesVary`] if the process has no derivatives of this order.
    pub(super) fn functionals(
        kernel: &Kernel,
        of: Functionals<'a>,
        count: usize,
        order: usize,
    ) -> Result<Self> {
        if has_variance(kernel, order) {
            Ok(Self::Functionals { of, count, order })
        } else {
            Err(NumericsError::DerivativesVary { order })
        }
    }

    /// Returns the numbers of rows for derivatives, and for the functionals that are made of them.
    pub(super) fn n_rows(&self, d: usize) -> [usize; 2] {
        match self {
            Self::Derivatives(derivatives) => [derivatives.len(), 0],
            Self::Functionals { count, order, .. } => {
                [if *order == 1 { d } else { d + d * (d + 1) / 2 }, *count]
            }
        }
    }

    /// Returns quantity number `at` of a lane. `functionals` are those of all lanes, `count` for each.
    pub(super) fn get<'b>(
        &'b self,
        functionals: &'b [ScaledFunctional],
        lane: usize,
        at: usize,
    ) -> Quantity<'b> {
        match self {
            Self::Derivatives(derivatives) => Quantity::Derivative(&derivatives[at]),
            Self::Functionals { count, .. } => Quantity::Functional(&functionals[lane * count + at]),
        }
    }
}

impl Quantity<'_> {
    /// Returns the prior variance, in units of the square of `unit`.
    pub(super) fn prior_variance(&self, kernel: &Kernel) -> f64 {
        match self {
            Self::Value => kernel.at_zero(),
            Self::Derivative(derivative) => derivative.prior_variance,
            Self::Functional(sized) => sized.functional.prior_variance(kernel),
        }
    }

    /// Returns the unit in which the quantity's prior variance and deviation are computed.
    pub(super) fn unit(&self) -> f64 {
        match self {
            Self::Value => 1.0,
            Self::Derivative(derivative) => derivative.unit,
            Self::Functional(sized) => sized.size,
        }
    }

    /// Returns the quantity divided by `unit`, applied to each function of a mean at position x, `[p]`.
    pub(super) fn on_mean(&self, basis: &Basis, x: &[f64]) -> Small {
        let mut functions = zeros(basis.n_functions());
        match self {
            Self::Value => basis.at(x, &mut functions),
            Self::Derivative(Derivative { axis: Some(axis), unit, .. }) => {
                let mut along = zeros(x.len());
                along[*axis] = 1.0 / unit;
                basis.add_slopes(&along, &mut functions);
            }
            // Second derivatives of a linear mean are 0.
            Self::Derivative(_) => {}
            Self::Functional(sized) => return Small::from_vec(sized.functional.on_mean(basis, x)),
        }
        functions
    }
}
