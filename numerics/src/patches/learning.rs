//! Group size, trend and hyperparameters of local regressions, chosen by a sample of neighbourhoods.

use std::sync::Arc;

use super::means::Support;
use super::neighbourhood::n_neighbours;
use super::pooled::{Kind, Weighted, pool, responsibilities};
use super::regression::{Model, n_terms};
use super::room::{Found, Purpose};
use super::{PatchGeometry, PatchKernel, Patches, check_dimension};
use crate::error::NumericsError;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::sampling::{Sampling, median};

/// Number of neighbourhoods whose likelihood is pooled, or fewer than twice as many.
const N_SITES: usize = 96;

/// Greatest number of sites that a caller of [`Patches::learned_at`] may choose.
pub const MAX_SITES: usize = 2 * N_SITES;

/// Points per mean, tried in this order.
const GROUPS: [usize; 7] = [1, 3, 8, 24, 72, 216, 648];

/// Least number of means that a group size must leave of a cloud to be tried.
const LEAST_MEANS: usize = 60;

/// Fraction to which deviations must fall for the next larger group size to be accepted, in the median over
/// the sites. Each site is compared with itself: deviations of a scan differ between sites by far more.
const WORTH: f64 = 0.95;

/// The same for means of three instead of points. Where there is hardly anything but noise, deviations fall
/// to a fifth, and in a lens that is thinner than its points are apart to two thirds. A scan thinned to a
/// twentieth, whose shape its points just resolve, lost half of the accuracy of its curvatures to means that
/// promised deviations of three quarters.
const WORTH_OF_MEANS: f64 = 0.7;

/// The same for a trend of fourth order instead of a quadric, where points are exact. Where points just
/// resolve a surface, both are as sure, and the quadric leaves more degrees of freedom to tell how sure.
const WORTH_OF_QUARTIC: f64 = 0.7;

impl Patches {
    /// Chooses group size and hyperparameters by a sample of the points that covers all spacings.
    ///
    /// # Errors
    /// [`NumericsError::DimensionTooSmall`] for d = 1, [`NumericsError::Cancelled`].
    pub fn of(
        cloud: Arc<Cloud>,
        sampling: Arc<Sampling>,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let sites = cloud.select(&sampling.of_every_spacing(N_SITES));
        Self::learned_at(&sites, cloud, sampling, observer)
    }

    /// Chooses group size and hyperparameters by the neighbourhoods of sites `[s, d]`. Parts of a cloud that
    /// hold the same neighbourhoods of the same sites learn the same.
    ///
    /// # Errors
    /// [`NumericsError::DimensionTooSmall`] for d = 1, [`NumericsError::Cancelled`].
    pub fn learned_at(
        sites: &Cloud,
        cloud: Arc<Cloud>,
        sampling: Arc<Sampling>,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        check_dimension(cloud.dimension())?;
        let mut best: Option<(Self, Vec<f64>)> = None;
        for group in GROUPS {
            if group > 1 && cloud.n_points() / group < LEAST_MEANS {
                break;
            }
            let support = Support::of(group, cloud.clone(), sampling.clone(), observer)?;
            let patches = Self::over(sites, support, observer)?;
            let deviations = patches.deviations(sites, observer)?;
            let is_exact = patches.noise == 0.0;
            let worth = if best.as_ref().is_some_and(|(best, _)| best.points_per_mean() == 1) {
                WORTH_OF_MEANS
            } else {
                WORTH
            };
            let is_better = best.as_ref().is_none_or(|(_, least)| ratio(&deviations, least) < worth);
            if is_better {
                best = Some((patches, deviations));
            }
            if !is_better || is_exact {
                break;
            }
        }
        let (best, deviations) = best.ok_or(NumericsError::EmptyCloud)?;
        best.with_quartic(&deviations, sites, observer)
    }

    /// Takes a trend of fourth order if points are exact and the largest deviations of curvatures at the
    /// sites fall enough, from these.
    fn with_quartic(
        mut self,
        deviations: &[f64],
        sites: &Cloud,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        if self.noise > 0.0 || self.points_per_mean() > 1 || self.models.is_empty() {
            return Ok(self);
        }
        self.quartic = self.pooled(Kind::Quartic, sites, observer)?;
        if ratio(&self.deviations(sites, observer)?, deviations) < WORTH_OF_QUARTIC {
            self.kernel = self.scales(&self.quartic, sites, observer)?.kernel;
        } else {
            self.quartic.clear();
        }
        Ok(self)
    }

    /// Learns the hyperparameters on one support.
    fn over(sites: &Cloud, support: Support, observer: &dyn Observer) -> Result<Self, NumericsError> {
        let d = sites.dimension();
        let count = n_neighbours(d, support.cloud().n_points());
        let mut patches = Self {
            support,
            models: Vec::new(),
            stiff: Vec::new(),
            quartic: Vec::new(),
            count,
            noise: 0.0,
            kernel: PatchKernel::default(),
        };
        if count < n_terms(d) + 2 {
            return Ok(patches);
        }
        patches.models = patches.pooled(Kind::Plain, sites, observer)?;
        Scales { noise: patches.noise, kernel: patches.kernel } =
            patches.scales(&patches.models, sites, observer)?;
        if patches.noise > 0.0 {
            patches.stiff = patches.pooled(Kind::Stiff, sites, observer)?;
        }
        Ok(patches)
    }

    /// Returns the mixture of models of one kind that makes the neighbourhoods of these queries most likely.
    fn pooled(
        &self,
        kind: Kind,
        queries: &Cloud,
        observer: &dyn Observer,
    ) -> Result<Vec<Weighted>, NumericsError> {
        let candidates = kind.candidates();
        let found = self.krige_each(queries, &candidates, Purpose::Likelihood, observer)?;
        let logs = |(_, kriged): &Found| kriged.iter().map(|k| k.log_likelihood).collect();
        Ok(pool(kind, &candidates, &found.iter().flatten().map(logs).collect::<Vec<Vec<f64>>>()))
    }

    /// Returns the largest deviation of a principal curvature at each site, 1/L, infinite where there is
    /// none.
    fn deviations(&self, sites: &Cloud, observer: &dyn Observer) -> Result<Vec<f64>, NumericsError> {
        let PatchGeometry { is_known, curvatures, .. } = self.at(sites, &|_| true, true, observer)?;
        let of_curvatures = curvatures.unwrap_or_default().principal;
        let rows = is_known.iter().zip(of_curvatures.chunks_exact(sites.dimension() - 1));
        let largest = |row: &[f64]| row.iter().copied().fold(0.0, f64::max);
        Ok(rows.map(|(is_known, row)| if *is_known { largest(row) } else { f64::INFINITY }).collect())
    }

    /// Returns noise and kernel of the heights by these models: medians over the sites.
    fn scales(
        &self,
        models: &[Weighted],
        sites: &Cloud,
        observer: &dyn Observer,
    ) -> Result<Scales, NumericsError> {
        let candidates: Vec<Model> = models.iter().map(|weighted| weighted.model).collect();
        let found = self.krige_each(sites, &candidates, Purpose::Likelihood, observer)?;
        let at_sites: Vec<[f64; 3]> =
            found.iter().flatten().filter_map(|found| scales(models, found)).collect();
        let middle = |at: usize| median(at_sites.iter().map(|scales| scales[at]).collect());
        Ok(Scales {
            noise: middle(0).unwrap_or(0.0).sqrt(),
            kernel: PatchKernel {
                length_scale: middle(1).unwrap_or(1.0),
                variance: middle(2).unwrap_or(1.0),
            },
        })
    }
}

/// Noise of the points across the surface, and kernel of the heights.
struct Scales {
    /// Standard deviation, unit L.
    noise: f64,
    kernel: PatchKernel,
}

/// Returns the variance of the noise (L²), ℓ (L) and s² (L²) of one neighbourhood, `None` where no model has
/// an answer.
fn scales(models: &[Weighted], (place, kriged): &Found) -> Option<[f64; 3]> {
    let shares = responsibilities(models, kriged);
    if shares.iter().all(|share| *share == 0.0) {
        return None;
    }
    let (mut noise, mut length_scale, mut variance) = (0.0, 0.0, 0.0);
    for ((share, kriged), Weighted { model, .. }) in shares.iter().zip(kriged).zip(models) {
        if *share > 0.0 {
            length_scale += share * model.length_scale * place.radius;
            variance += share * kriged.scale * place.radius.powi(2);
            // Ratios up to 1e-7 are rounding and count as no noise.
            noise += share * if model.noise > 1e-7 { kriged.scale * model.noise } else { 0.0 };
        }
    }
    Some([noise * place.radius.powi(2), length_scale, variance])
}

/// Median ratio of deviations at the same sites, infinite where none is finite.
fn ratio(deviations: &[f64], others: &[f64]) -> f64 {
    let ratios = deviations.iter().zip(others).map(|(a, b)| a / b);
    median(ratios.filter(|ratio| !ratio.is_nan()).collect()).unwrap_or(f64::INFINITY)
}
