//! Hyperparameters of local regressions, as answers report them and requests give them.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::http::problem::Problem;
use gramian_numerics::patches::{
    self, Agreement, CoarserHyperparameters, MAX_COARSER, MAX_MODELS, N_BIASES, PatchHyperparameters,
    PatchKernel,
};
use gramian_numerics::surface::local::SurfaceHyperparameters;

/// What local regressions learned of a cloud.
///
/// Send it back as it came, as `hyperparameters` of a request about a part of the cloud. It is opaque: its
/// members may change in any version, and one of another version may be refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Hyperparameters {
    /// Mixture of noise ratios. Empty where nothing can be regressed.
    #[schema(max_items = 8)]
    pub noise_ratios: Vec<NoiseRatio>,
    /// The part of this mixture with a rougher process, for curvatures that jump. Its shares count with those
    /// of `noise_ratios`.
    #[serde(default)]
    #[schema(max_items = 8)]
    pub rough_noise_ratios: Vec<NoiseRatio>,
    /// Mixture of noise ratios for normals where the surface is flat. Empty where there is no noise.
    #[schema(max_items = 8)]
    pub flat_noise_ratios: Vec<NoiseRatio>,
    /// Mixture of noise ratios beside polynomials of fourth order. Empty where points have noise, or quadrics
    /// are as sure.
    #[serde(default)]
    #[schema(max_items = 8)]
    pub quartic_noise_ratios: Vec<NoiseRatio>,
    /// Regressions over means of points, which are weighed with those over points at each place. Each
    /// level has twice as many points a mean as the one before, or more. Empty where points have no noise, or
    /// means are no surer.
    #[serde(default)]
    #[schema(max_items = 6)]
    pub means: Vec<MeansLevel>,
    /// Standard deviation of the noise of the points across the surface, length.
    #[schema(minimum = 0.0)]
    pub noise_deviation: f64,
    /// The same, or 0 where it may be bends of a coarsely sampled surface, length. Neighbourhoods do not take
    /// it for a bend.
    #[serde(default)]
    #[schema(minimum = 0.0)]
    pub bend_noise_deviation: f64,
    /// Length scale of the heights of the surface over its tangent planes.
    #[schema(minimum = 0.0)]
    pub length_scale: f64,
    /// Variance of these heights, length squared.
    #[schema(minimum = 0.0)]
    pub variance: f64,
    /// Half the diagonal of the bounding box of the cloud, length. Beside it, small curvatures count as 0.
    #[schema(exclusive_minimum = 0.0)]
    pub radius: f64,
    /// Least ratio of a curvature to its deviation at which the curvature counts as known. Absent if none
    /// is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0.0)]
    pub least_ratio: Option<f64>,
}

/// What local regressions over means of points learned.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MeansLevel {
    /// Most points of a mean.
    #[schema(minimum = 2)]
    pub points_per_mean: usize,
    /// Mixture of noise ratios.
    #[schema(max_items = 8)]
    pub noise_ratios: Vec<NoiseRatio>,
    /// Mixture of noise ratios for normals where the surface is flat.
    #[schema(max_items = 8)]
    pub flat_noise_ratios: Vec<NoiseRatio>,
    /// Shares of the places at which normals are off those over fewer points by 0, 0.1, 0.3, 1, 3, 10, 30,
    /// 100 and 1,000 times the variance that noise explains.
    #[schema(max_items = 9)]
    pub normal_bias_shares: Vec<f64>,
    /// The same of curvatures.
    #[schema(max_items = 9)]
    pub curvature_bias_shares: Vec<f64>,
}

/// A ratio of the variance of the noise to that of the heights, and how common it is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseRatio {
    /// The variance of the noise of a point divided by that of the heights.
    #[schema(minimum = 0.0)]
    pub ratio: f64,
    /// The natural logarithm of the share of neighbourhoods with this ratio.
    #[schema(maximum = 0.0)]
    pub log_share: f64,
}

impl Hyperparameters {
    /// Reports what a surface learned, or was given.
    pub fn of(learned: &SurfaceHyperparameters) -> Self {
        let SurfaceHyperparameters { regression, radius, least_ratio } = learned;
        Self {
            noise_ratios: reported(&regression.noise_ratios),
            rough_noise_ratios: reported(&regression.rough_noise_ratios),
            flat_noise_ratios: reported(&regression.flat_noise_ratios),
            quartic_noise_ratios: reported(&regression.quartic_noise_ratios),
            means: regression.coarser.iter().map(MeansLevel::of).collect(),
            noise_deviation: regression.noise,
            bend_noise_deviation: regression.bend_noise,
            length_scale: regression.kernel.length_scale,
            variance: regression.kernel.variance,
            radius: *radius,
            least_ratio: Some(*least_ratio).filter(|ratio| ratio.is_finite()),
        }
    }

    /// Checks hyperparameters of a request.
    ///
    /// # Errors
    /// 422 with a pointer to the first member that is out of its range.
    pub fn plan(&self) -> Result<SurfaceHyperparameters, Problem> {
        let refuse = |member: &str, requirement: &str| {
            Err(Problem::invalid_request(format!("/hyperparameters/{member}"), requirement))
        };
        for (member, number) in [
            ("noise_deviation", self.noise_deviation),
            ("bend_noise_deviation", self.bend_noise_deviation),
            ("length_scale", self.length_scale),
            ("variance", self.variance),
            ("least_ratio", self.least_ratio.unwrap_or_default()),
        ] {
            if number < 0.0 {
                return refuse(member, "must be 0 or more");
            }
        }
        if self.radius <= 0.0 {
            return refuse("radius", "must be more than 0");
        }
        let regression = PatchHyperparameters {
            noise_ratios: ratios(&self.noise_ratios, "noise_ratios")?,
            rough_noise_ratios: ratios(&self.rough_noise_ratios, "rough_noise_ratios")?,
            flat_noise_ratios: ratios(&self.flat_noise_ratios, "flat_noise_ratios")?,
            quartic_noise_ratios: ratios(&self.quartic_noise_ratios, "quartic_noise_ratios")?,
            coarser: levels(&self.means)?,
            noise: self.noise_deviation,
            bend_noise: self.bend_noise_deviation,
            kernel: PatchKernel { length_scale: self.length_scale, variance: self.variance },
        };
        let least_ratio = self.least_ratio.unwrap_or(f64::INFINITY);
        Ok(SurfaceHyperparameters { regression, radius: self.radius, least_ratio })
    }
}

impl MeansLevel {
    fn of(learned: &CoarserHyperparameters) -> Self {
        Self {
            points_per_mean: learned.points_per_mean,
            noise_ratios: reported(&learned.noise_ratios),
            flat_noise_ratios: reported(&learned.flat_noise_ratios),
            normal_bias_shares: learned.agreement.normals.clone(),
            curvature_bias_shares: learned.agreement.curvatures.clone(),
        }
    }

    /// Checks the level number `at`, whose means have `least` points or more.
    fn checked(&self, at: usize, least: usize) -> Result<CoarserHyperparameters, Problem> {
        let member = |name: &str| format!("means/{at}/{name}");
        if self.points_per_mean < least {
            return Err(refusal(&member("points_per_mean"), &format!("must be {least} or more")));
        }
        Ok(CoarserHyperparameters {
            points_per_mean: self.points_per_mean,
            noise_ratios: ratios(&self.noise_ratios, &member("noise_ratios"))?,
            flat_noise_ratios: ratios(&self.flat_noise_ratios, &member("flat_noise_ratios"))?,
            agreement: Agreement {
                normals: checked_shares(&self.normal_bias_shares, &member("normal_bias_shares"))?,
                curvatures: checked_shares(&self.curvature_bias_shares, &member("curvature_bias_shares"))?,
            },
        })
    }
}

fn checked_shares(given: &[f64], member: &str) -> Result<Vec<f64>, Problem> {
    if given.len() != N_BIASES || given.iter().any(|share| !(0.0..=1.0).contains(share)) {
        return Err(refusal(member, &format!("must be {N_BIASES} shares from 0 to 1")));
    }
    Ok(given.to_vec())
}

fn reported(of: &[patches::NoiseRatio]) -> Vec<NoiseRatio> {
    of.iter().map(|of| NoiseRatio { ratio: of.ratio, log_share: of.log_share }).collect()
}

fn levels(given: &[MeansLevel]) -> Result<Vec<CoarserHyperparameters>, Problem> {
    if given.len() > MAX_COARSER {
        return Err(refusal("means", &format!("at most {MAX_COARSER} levels of means")));
    }
    let least = |at: usize| if at == 0 { 2 } else { given[at - 1].points_per_mean.saturating_mul(2) };
    given.iter().enumerate().map(|(at, level)| level.checked(at, least(at))).collect()
}

fn refusal(member: &str, requirement: &str) -> Problem {
    Problem::invalid_request(format!("/hyperparameters/{member}"), requirement)
}

fn ratios(given: &[NoiseRatio], member: &str) -> Result<Vec<patches::NoiseRatio>, Problem> {
    if given.len() > MAX_MODELS {
        let detail = format!("a mixture has at most {MAX_MODELS} noise ratios");
        return Err(Problem::invalid_request(format!("/hyperparameters/{member}"), detail));
    }
    let checked = |(at, &NoiseRatio { ratio, log_share }): (usize, &NoiseRatio)| {
        if ratio >= 0.0 && log_share <= 0.0 {
            return Ok(patches::NoiseRatio { ratio, log_share });
        }
        let detail = "the ratio must be 0 or more, and log_share 0 or less";
        Err(Problem::invalid_request(format!("/hyperparameters/{member}/{at}"), detail))
    };
    given.iter().enumerate().map(checked).collect()
}
