//! Hyperparameters of local regressions, as answers report them and requests give them.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::http::problem::Problem;
use gramian_numerics::patches::{self, MAX_MODELS, PatchHyperparameters, PatchKernel};
use gramian_numerics::surface::local::SurfaceHyperparameters;

/// What local regressions learned of a cloud.
///
/// Sent as `hyperparameters` of a request about a part of the cloud, they are used as they are.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Hyperparameters {
    /// Most points that a regression averages before it sees them. 1 where it sees the points themselves.
    #[schema(minimum = 1)]
    pub points_per_mean: usize,
    /// Mixture of noise ratios. Empty where nothing can be regressed.
    #[schema(max_items = 6)]
    pub noise_ratios: Vec<NoiseRatio>,
    /// Mixture of noise ratios for normals where the surface is flat. Empty where there is no noise.
    #[schema(max_items = 6)]
    pub flat_noise_ratios: Vec<NoiseRatio>,
    /// Mixture of noise ratios beside polynomials of fourth order. Empty where points have noise, or quadrics
    /// are as sure.
    #[serde(default)]
    #[schema(max_items = 6)]
    pub quartic_noise_ratios: Vec<NoiseRatio>,
    /// Standard deviation of the noise of the points across the surface, length.
    #[schema(minimum = 0.0)]
    pub noise_deviation: f64,
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
        let ratios = |of: &[patches::NoiseRatio]| {
            of.iter().map(|of| NoiseRatio { ratio: of.ratio, log_share: of.log_share }).collect()
        };
        Self {
            points_per_mean: regression.points_per_mean,
            noise_ratios: ratios(&regression.noise_ratios),
            flat_noise_ratios: ratios(&regression.flat_noise_ratios),
            quartic_noise_ratios: ratios(&regression.quartic_noise_ratios),
            noise_deviation: regression.noise,
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
        if self.points_per_mean == 0 {
            return refuse("points_per_mean", "a mean has 1 point or more");
        }
        for (member, number) in [
            ("noise_deviation", self.noise_deviation),
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
            points_per_mean: self.points_per_mean,
            noise_ratios: ratios(&self.noise_ratios, "noise_ratios")?,
            flat_noise_ratios: ratios(&self.flat_noise_ratios, "flat_noise_ratios")?,
            quartic_noise_ratios: ratios(&self.quartic_noise_ratios, "quartic_noise_ratios")?,
            noise: self.noise_deviation,
            kernel: PatchKernel { length_scale: self.length_scale, variance: self.variance },
        };
        let least_ratio = self.least_ratio.unwrap_or(f64::INFINITY);
        Ok(SurfaceHyperparameters { regression, radius: self.radius, least_ratio })
    }
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
