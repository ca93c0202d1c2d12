//! The box of logarithms that a search explores.

use super::contraction::Sums;
use crate::error::{NumericsError, Result};
use crate::kernel::Family;
use crate::regression::selection::parameters::{Hyperparameters, Parameter, Variation};
use crate::regression::selection::prior::JointlyRobust;
use crate::regression::sums::regularization::Regularization;

/// Hyperparameters as a function of the logarithms of the free numbers, which lie in a box.
#[derive(Debug, Clone)]
pub(in crate::regression::selection) struct Space {
    base: Hyperparameters,
    /// Variation of each free number. [`Parameter::LengthScales`] is split into its axes.
    free: Vec<Variation>,
    /// Prior of the length scales of axes.
    prior: Option<JointlyRobust>,
}

impl Space {
    /// Creates the space of the free numbers. Starting values are moved into their bounds.
    ///
    /// # Errors
    /// [`NumericsError::InvalidVariation`].
    pub(in crate::regression::selection) fn of(
        base: &Hyperparameters,
        vary: &[Variation],
        dimension: usize,
    ) -> Result<Self> {
        let mut space = Self { base: base.clone(), free: Vec::new(), prior: None };
        for (entry, &variation) in vary.iter().enumerate() {
            let refuse = |requirement| NumericsError::InvalidVariation { entry, requirement };
            variation.check_bounds().map_err(refuse)?;
            let Variation { parameter, min, max } = variation;
            let axes = match parameter {
                Parameter::LengthScales => 0..dimension,
                Parameter::LengthScaleOfAxis(axis) if axis >= dimension => {
                    return Err(refuse("must name an axis of the cloud"));
                }
                Parameter::LengthScaleOfAxis(axis) => axis..axis + 1,
                _ => 0..0,
            };
            if !axes.is_empty() && space.base.length_scales.len() == 1 {
                space.base.length_scales = vec![space.base.length_scales[0]; dimension];
            }
            let single = axes.is_empty().then_some(parameter);
            let of_axes = axes.map(Parameter::LengthScaleOfAxis);
            for parameter in single.into_iter().chain(of_axes) {
                space.free.push(Variation { parameter, min, max });
            }
        }
        space.check_distinct(vary)?;
        space.base = space.at(&space.start());
        Ok(space)
    }

    /// Returns the space with a prior on the length scales of axes, which counts if any of them varies.
    pub(in crate::regression::selection) fn with_prior(self, prior: JointlyRobust) -> Self {
        let prior = self.per_axis().then_some(prior);
        Self { prior, ..self }
    }

    /// Returns the space for some of the points.
    pub(in crate::regression::selection) fn on(&self, points: &[usize]) -> Self {
        let mut space = self.clone();
        if let Regularization::PerPoint(variances) = &self.base.noise {
            let some: Vec<f64> = points.iter().map(|&point| variances[point]).collect();
            space.base.noise = Regularization::PerPoint(some);
        }
        space
    }

    /// Returns the logarithm of the prior density, up to a constant. 0 without a prior.
    pub(in crate::regression::selection) fn log_prior(&self, at: &Hyperparameters) -> f64 {
        self.prior.as_ref().map_or(0.0, |prior| prior.log_density(&at.length_scales))
    }

    /// Adds the derivatives of the prior by the logarithms of the free numbers.
    pub(in crate::regression::selection) fn add_prior_slopes(
        &self,
        at: &Hyperparameters,
        slopes: &mut [f64],
    ) {
        let Some(prior) = &self.prior else { return };
        for (free, slope) in self.free.iter().zip(slopes) {
            if let Parameter::LengthScaleOfAxis(axis) = free.parameter {
                *slope += prior.slope(&at.length_scales, axis);
            }
        }
    }

    /// Checks that no parameter varies twice, and that ℓ and α are single numbers where they vary as such.
    fn check_distinct(&self, vary: &[Variation]) -> Result<()> {
        let last = vary.len().saturating_sub(1);
        let has_axes = self.base.length_scales.len() > 1 || self.per_axis();
        for (at, free) in self.free.iter().enumerate() {
            let entry = vary.iter().rposition(|v| v.parameter == free.parameter).unwrap_or(last);
            let refuse = |requirement| Err(NumericsError::InvalidVariation { entry, requirement });
            if self.free[..at].iter().any(|other| other.parameter == free.parameter) {
                return refuse("must not vary a parameter twice");
            }
            match free.parameter {
                Parameter::LengthScale if has_axes => {
                    return refuse("cannot vary one length scale where every axis has its own");
                }
                Parameter::Alpha if self.base.alpha().is_none() => {
                    return refuse("cannot vary alpha where every point has its own noise");
                }
                _ => {}
            }
        }
        Ok(())
    }

    pub(in crate::regression::selection) fn n_free(&self) -> usize {
        self.free.len()
    }

    /// Parameters of the free numbers.
    pub(in crate::regression::selection) fn parameters(&self) -> impl Iterator<Item = Parameter> + '_ {
        self.free.iter().map(|free| free.parameter)
    }

    /// Returns whether slopes along single axes are needed.
    pub(in crate::regression::selection) fn per_axis(&self) -> bool {
        self.free.iter().any(|free| matches!(free.parameter, Parameter::LengthScaleOfAxis(_)))
    }

    /// Bounds of the logarithms.
    pub(in crate::regression::selection) fn bounds(&self) -> Vec<(f64, f64)> {
        self.free.iter().map(|free| (free.min.ln(), free.max.ln())).collect()
    }

    /// The family at the start.
    pub(in crate::regression::selection) fn family(&self) -> Family {
        self.base.family
    }

    /// Logarithms at which the search begins.
    pub(in crate::regression::selection) fn start(&self) -> Vec<f64> {
        self.numbers_of(&self.base)
    }

    /// Returns the hyperparameters with these logarithms.
    pub(in crate::regression::selection) fn at(&self, logarithms: &[f64]) -> Hyperparameters {
        let mut found = self.base.clone();
        for (free, logarithm) in self.free.iter().zip(logarithms) {
            let number = free.number(*logarithm);
            match free.parameter {
                Parameter::LengthScale => found.length_scales = vec![number],
                Parameter::LengthScales => found.length_scales.fill(number),
                Parameter::LengthScaleOfAxis(axis) => found.length_scales[axis] = number,
                Parameter::Variance => found.variance = number,
                Parameter::Alpha => found.noise = Regularization::Uniform(number),
                Parameter::Epsilon => {
                    if let Family::Laplace { epsilon } = &mut found.family {
                        *epsilon = number;
                    }
                }
            }
        }
        found
    }

    /// Returns the derivatives by the logarithms, from the sums over pairs and the trace of their weights.
    pub(in crate::regression::selection) fn gradient(
        &self,
        at: &Hyperparameters,
        sums: &Sums,
        trace: f64,
    ) -> Vec<f64> {
        let v = at.variance;
        let slope = |free: &Variation| match free.parameter {
            Parameter::LengthScale | Parameter::LengthScales => -2.0 * v * sums.of_scaled_slopes,
            Parameter::LengthScaleOfAxis(axis) => -2.0 * v * sums.of_axes[axis],
            Parameter::Variance => v * sums.of_values,
            Parameter::Alpha => at.alpha().unwrap_or(0.0) * trace,
            Parameter::Epsilon => match at.family {
                Family::Laplace { epsilon } => v * epsilon * sums.of_slopes,
                _ => 0.0,
            },
        };
        self.free.iter().map(slope).collect()
    }

    fn numbers_of(&self, of: &Hyperparameters) -> Vec<f64> {
        let number = |free: &Variation| match free.parameter {
            Parameter::LengthScale | Parameter::LengthScales => of.length_scales[0],
            Parameter::LengthScaleOfAxis(axis) => of.length_scales[axis],
            Parameter::Variance => of.variance,
            Parameter::Alpha => of.alpha().unwrap_or(free.min),
            Parameter::Epsilon => match of.family {
                Family::Laplace { epsilon } => epsilon,
                _ => free.min,
            },
        };
        // Bounds are positive, so a number that was 0 has a logarithm as well.
        self.free.iter().map(|free| number(free).clamp(free.min, free.max).ln()).collect()
    }
}
