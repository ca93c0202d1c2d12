//! Levels, trend and hyperparameters of local regressions, chosen by a sample of neighbourhoods.

use std::sync::Arc;

use super::level::Level;
use super::levels::median_excess;
use super::means::Support;
use super::pooled::{Kind, WeightedModel, pool, responsibilities};
use super::regression::{Model, n_terms};
use super::room::{Found, Purpose};
use super::{Agreement, Coarser, PatchGeometry, PatchKernel, Patches, check_dimension};
use crate::error::NumericsError;
use crate::observer::Observer;
use crate::points::cloud::Cloud;
use crate::points::sampling::{Sampling, median};

/// Number of neighbourhoods whose likelihood is pooled, or fewer than twice as many.
const N_SITES: usize = 96;

/// Number of points at which levels of means are compared, or fewer than twice as many.
const N_CHECKS: usize = 2048;

/// Greatest number of sites that a caller of [`Patches::learned_at`] may choose.
pub const MAX_SITES: usize = 2 * N_SITES;

/// Greatest number of levels of means.
pub const MAX_COARSER: usize = 6;

/// Points per mean, tried in this order.
const GROUPS: [usize; MAX_COARSER] = [3, 8, 24, 72, 216, 648];

/// Greatest excess of refined normals over those of the points ([`median_excess`]), as a multiple of that of
/// the first level. It stays below 1.6 on smooth surfaces, and is 1.6 to 3.5 where means have missed detail
/// (docs/error-bars.md).
const EXCESS_OF_FIRST: f64 = 1.6;

/// Least number of neighbourhoods that a cloud has the points of if it tells noise from bends.
const LEAST_NEIGHBOURHOODS: usize = 4;

/// Greatest factor by which noise may grow with the neighbourhoods. On scans it is 0.95 to 1.1.
const MOST_GROWTH: f64 = 1.25;

/// Number of levels that make nothing surer after which larger means are not tried.
const IN_VAIN: usize = 1;

/// Least number of means that a group size must leave of a cloud to be tried.
const LEAST_MEANS: usize = 60;

/// Fraction to which deviations must fall for a level to be taken, in the median over the sites. Each site is
/// compared with itself: deviations of a scan differ between sites by far more.
const WORTH: f64 = 0.95;

/// The same for a trend of fourth order instead of a quadric, where points are exact. Where points just
/// resolve a surface, both are as sure, and the quadric leaves more degrees of freedom to tell how sure.
const WORTH_OF_QUARTIC: f64 = 0.7;

struct Points {
    cloud: Arc<Cloud>,
    sampling: Arc<Sampling>,
}

impl Patches {
    /// Chooses levels and hyperparameters by a sample of the points that covers all spacings.
    ///
    /// # Errors
    /// [`NumericsError::DimensionTooSmall`] for d = 1, [`NumericsError::Cancelled`].
    pub fn of(
        cloud: Arc<Cloud>,
        sampling: Arc<Sampling>,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let [sites, checks] = [N_SITES, N_CHECKS].map(|n| cloud.select(&sampling.of_every_spacing(n)));
        Self::learned(&sites, &checks, Points { cloud, sampling }, observer)
    }

    /// Chooses levels and hyperparameters by the neighbourhoods of sites `[s, d]`. Parts of a cloud that
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
        Self::learned(sites, sites, Points { cloud, sampling }, observer)
    }

    fn learned(
        sites: &Cloud,
        checks: &Cloud,
        Points { cloud, sampling }: Points,
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        check_dimension(cloud.dimension())?;
        let over = |group: usize, noise: f64| {
            let support = Support::of(group, cloud.clone(), sampling.clone(), observer)?;
            Level::over(sites, support, noise, observer)
        };
        let (mut finest, Scales { mut noise, mut kernel }) = over(1, 0.0)?;
        if noise > 0.0 && cloud.n_points() >= LEAST_NEIGHBOURHOODS * finest.count {
            let (grown, again) = over(1, noise)?;
            // Bends of a coarsely sampled surface are no noise: it grows with the neighbourhoods.
            if again.noise > 0.0 && again.noise <= MOST_GROWTH * noise {
                (finest, noise, kernel) = (grown, again.noise, again.kernel);
            }
        }
        let bend_noise = finest.bend_noise;
        let mut patches = Self { finest, coarser: Vec::new(), noise, kernel };
        if noise == 0.0 {
            patches.try_quartic(sites, observer)?;
        } else {
            let groups = GROUPS.into_iter().take_while(|group| cloud.n_points() / group >= LEAST_MEANS);
            patches.add_means(checks, groups.map(|group| Ok(over(group, bend_noise)?.0)), observer)?;
        }
        Ok(patches)
    }

    /// Adds levels of means while these make answers surer and leave no slopes of the points.
    fn add_means(
        &mut self,
        checks: &Cloud,
        levels: impl Iterator<Item = Result<Level, NumericsError>>,
        observer: &dyn Observer,
    ) -> Result<(), NumericsError> {
        let d = checks.dimension();
        let at_points = self.finest.at(checks, &|_| true, true, observer)?;
        let mut refined = at_points.clone();
        let (mut n_taken, mut least, mut most_excess) = (0, uncertainties(&refined, d), None);
        for level in levels {
            let level = level?;
            let own = level.at(checks, &|_| true, true, observer)?;
            let agreement = Agreement::of(&refined, &own, d);
            refined.refine(&own, &agreement, d);
            self.coarser.push(Coarser { level, agreement });
            let excess = median_excess(&at_points, &refined, d);
            let has_missed_detail = excess > *most_excess.get_or_insert(EXCESS_OF_FIRST * excess)
                || self.finest.has_slopes_over(&refined, checks, self.noise);
            let found = uncertainties(&refined, d);
            if !has_missed_detail && ratio(&found, &least) < WORTH {
                (n_taken, least) = (self.coarser.len(), found);
            }
            // Larger means miss what smaller ones have missed.
            if has_missed_detail || self.coarser.len() > n_taken + IN_VAIN {
                break;
            }
        }
        self.coarser.truncate(n_taken);
        Ok(())
    }

    /// Takes a trend of fourth order if the largest deviations of curvatures at the sites fall enough. Points
    /// are exact.
    fn try_quartic(&mut self, sites: &Cloud, observer: &dyn Observer) -> Result<(), NumericsError> {
        if self.finest.models.is_empty() {
            return Ok(());
        }
        let least = deviations(&self.finest.at(sites, &|_| true, true, observer)?, sites.dimension());
        self.finest.quartic = self.finest.pooled(&[Kind::Quartic], sites, observer)?;
        let found = self.finest.at(sites, &|_| true, true, observer)?;
        if ratio(&deviations(&found, sites.dimension()), &least) < WORTH_OF_QUARTIC {
            self.kernel = self.finest.scales(&self.finest.quartic, sites, observer)?.kernel;
        } else {
            self.finest.quartic.clear();
        }
        Ok(())
    }
}

impl Level {
    /// Learns the models on one support from the neighbourhoods of sites.
    fn over(
        sites: &Cloud,
        support: Support,
        bend_noise: f64,
        observer: &dyn Observer,
    ) -> Result<(Self, Scales), NumericsError> {
        let mut level = Self::of(support, bend_noise);
        if level.count < n_terms(sites.dimension()) + 2 {
            return Ok((level, Scales { noise: 0.0, kernel: PatchKernel::default() }));
        }
        // Means of points blur what jumps.
        let is_of_means = level.support.points_per_mean() > 1;
        let kinds = if is_of_means { &[Kind::Plain][..] } else { &[Kind::Plain, Kind::Rough] };
        level.models = level.pooled(kinds, sites, observer)?;
        // This is their order where hyperparameters are given.
        level.models.sort_by_key(|of| Kind::Rough.describes(&of.model));
        let scales = level.scales(&level.models, sites, observer)?;
        if scales.noise > 0.0 {
            level.stiff = level.pooled(&[Kind::Stiff], sites, observer)?;
        }
        Ok((level, scales))
    }

    /// Returns the mixture of models of these kinds that makes the neighbourhoods of queries most likely.
    fn pooled(
        &self,
        kinds: &[Kind],
        queries: &Cloud,
        observer: &dyn Observer,
    ) -> Result<Vec<WeightedModel>, NumericsError> {
        let candidates: Vec<Model> = kinds.iter().flat_map(|kind| kind.candidates()).collect();
        let least_share = kinds.iter().map(|kind| kind.least_share()).fold(0.0, f64::max);
        let found = self.krige_each(queries, &candidates, Purpose::Likelihood, observer)?;
        let logs = |(_, kriged): &Found| kriged.iter().map(|k| k.log_likelihood).collect();
        Ok(pool(least_share, &candidates, &found.iter().flatten().map(logs).collect::<Vec<Vec<f64>>>()))
    }

    /// Returns noise and kernel of the heights by these models: medians over the sites.
    fn scales(
        &self,
        models: &[WeightedModel],
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
fn scales(models: &[WeightedModel], (place, kriged): &Found) -> Option<[f64; 3]> {
    let shares = responsibilities(models, kriged);
    if shares.iter().all(|share| *share == 0.0) {
        return None;
    }
    let (mut noise, mut length_scale, mut variance) = (0.0, 0.0, 0.0);
    for ((share, kriged), WeightedModel { model, .. }) in shares.iter().zip(kriged).zip(models) {
        if *share > 0.0 {
            length_scale += share * model.length_scale * place.radius;
            variance += share * kriged.scale * place.radius.powi(2);
            // Ratios up to 1e-7 are rounding and count as no noise.
            noise += share * if model.noise > 1e-7 { kriged.scale * model.noise } else { 0.0 };
        }
    }
    Some([noise * place.radius.powi(2), length_scale, variance])
}

/// Returns the largest deviation of a principal curvature at each site, 1/L, infinite where there is none.
fn deviations(found: &PatchGeometry, dimension: usize) -> Vec<f64> {
    let rows = found.curvatures.iter().flat_map(|of| of.principal.chunks_exact(dimension - 1));
    let largest = |row: &[f64]| row.iter().copied().fold(0.0, f64::max);
    let is_known = found.is_known.iter();
    is_known.zip(rows).map(|(is_known, row)| if *is_known { largest(row) } else { f64::INFINITY }).collect()
}

/// Returns the geometric mean of the deviations of normal and curvature at each site.
fn uncertainties(found: &PatchGeometry, dimension: usize) -> Vec<f64> {
    let curvatures = deviations(found, dimension);
    curvatures.iter().zip(&found.normal_std).map(|(a, b)| (a * b).sqrt()).collect()
}

/// Median ratio of deviations at the same sites, infinite where none is finite.
fn ratio(deviations: &[f64], others: &[f64]) -> f64 {
    let ratios = deviations.iter().zip(others).map(|(a, b)| a / b);
    median(ratios.filter(|ratio| !ratio.is_nan()).collect()).unwrap_or(f64::INFINITY)
}
