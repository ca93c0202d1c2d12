//! What deviations are asked of beside the value.

use crate::error::NumericsError;
use crate::function::functionals::{JetFunctional, has_variance};
use crate::kernel::Kernel;
use crate::machine::small::{Small, zeros};
use crate::solver::trend::Basis;

/// The functionals of a query, as many for each.
pub(crate) type Functionals<'a> = &'a (dyn Fn(usize) -> Vec<JetFunctional> + Sync);

/// Beside the value.
pub(super) enum Quantities<'a> {
    /// Derivatives, the same at each query.
    Derivatives(Vec<Derivative>),
    /// Functionals of derivatives up to an order, so many at each query.
    Functionals { of: Functionals<'a>, count: usize, order: usize },
}

/// One of them, at a query.
#[derive(Clone, Copy)]
pub(super) enum Quantity<'a> {
    Value,
    Derivative(&'a Derivative),
    Functional(&'a Sized),
}

/// A derivative.
pub(super) struct Derivative {
    /// The axis, for a first one.
    axis: Option<usize>,
    /// In units of ℓ.
    prior_variance: f64,
    /// What turns its deviation in units of ℓ into one along the axes.
    unit: f64,
}

/// A functional over its size, so that its square has a number.
pub(super) struct Sized {
    functional: JetFunctional,
    size: f64,
}

impl Sized {
    pub(super) fn of(functional: &JetFunctional, kernel: &Kernel) -> Self {
        let size = functional.size(kernel);
        Self { functional: functional.over(size), size }
    }

    /// Its coefficients on derivatives in units of ℓ: `[d]`, then the upper triangle of those of second order.
    pub(super) fn coefficients(&self, kernel: &Kernel) -> Small {
        self.functional.coefficients(kernel)
    }
}

impl<'a> Quantities<'a> {
    /// Derivatives up to an order.
    ///
    /// # Errors
    /// [`NumericsError::DerivativesVary`] where the process has none.
    pub(super) fn derivatives(kernel: &Kernel, d: usize, order: usize) -> Result<Self, NumericsError> {
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

    /// # Errors
    /// [`NumericsError::DerivativesVary`] where the process has none of this order.
    pub(super) fn functionals(
        kernel: &Kernel,
        of: Functionals<'a>,
        count: usize,
        order: usize,
    ) -> Result<Self, NumericsError> {
        match has_variance(kernel, order) {
            true => Ok(Self::Functionals { of, count, order }),
            false => Err(NumericsError::DerivativesVary { order }),
        }
    }

    /// Rows of derivatives that are needed, and those made of them.
    pub(super) fn n_rows(&self, d: usize) -> [usize; 2] {
        match self {
            Self::Derivatives(derivatives) => [derivatives.len(), 0],
            Self::Functionals { count, order, .. } => {
                [if *order == 1 { d } else { d + d * (d + 1) / 2 }, *count]
            }
        }
    }

    /// One of them, in a lane of which the functionals are at hand.
    pub(super) fn get<'b>(&'b self, functionals: &'b [Sized], (lane, at): (usize, usize)) -> Quantity<'b> {
        match self {
            Self::Derivatives(derivatives) => Quantity::Derivative(&derivatives[at]),
            Self::Functionals { count, .. } => Quantity::Functional(&functionals[lane * count + at]),
        }
    }
}

impl Quantity<'_> {
    /// In squares of its unit.
    pub(super) fn prior_variance(&self, kernel: &Kernel) -> f64 {
        match self {
            Self::Value => kernel.at_zero(),
            Self::Derivative(derivative) => derivative.prior_variance,
            Self::Functional(sized) => sized.functional.prior_variance(kernel),
        }
    }

    /// What its deviation is in units of.
    pub(super) fn unit(&self) -> f64 {
        match self {
            Self::Value => 1.0,
            Self::Derivative(derivative) => derivative.unit,
            Self::Functional(sized) => sized.size,
        }
    }

    /// On the functions of a mean, at a position.
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
