//! The points of a noisy cloud, moved onto their surface.

use crate::error::NumericsError;
use crate::observer::Observer;
use crate::patches::PatchGeometry;
use crate::points::cloud::Cloud;
use crate::points::sampling::Sampling;

/// Noise across the surface, in spacings, from which points are moved. Of curves it is in nearest distances:
/// the points that a spacing is the mean of lie two steps away on either side, and it is single steps that
/// noise turns.
///
/// Steps between points that noise has moved apart look like steps to another sheet, and areas between them
/// come out too large, by 2.4 with noise of half a spacing. A third of the normals of random tori then
/// pointed inward. The noise of scans is a sixteenth of a spacing and less.
const NOISY: f64 = 0.2;

/// Pairs of quantiles of the sizes of heights, and the largest ratio of the lower to the higher at which
/// heights are noise.
///
/// The two sheets of a thin body have heights too, whose feet would lie on a sheet between them. But their
/// sizes are nearly equal on a plate (ratio 1), and evenly spread on a lens (0.56 and 0.84). The sizes of
/// normal noise have 0.41 and 0.65, those of heavier tails less.
const LIKE_NOISE: [(Quantiles, f64); 2] =
    [(Quantiles { lower: 0.5, upper: 0.9 }, 0.48), (Quantiles { lower: 0.8, upper: 0.95 }, 0.74)];

struct Quantiles {
    lower: f64,
    upper: f64,
}

/// The feet of the points of a cloud, with their sampling.
pub(crate) struct SmoothedCloud {
    cloud: Cloud,
    sampling: Sampling,
}

impl SmoothedCloud {
    /// Moves points by their heights, if the noise is such that their sides could not be told ([`is_noisy`]).
    /// Points without a regression stay where they are.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(crate) fn of_noisy(
        points: SampledCloud<'_>,
        geometry: &PatchGeometry,
        noise: f64,
        observer: &dyn Observer,
    ) -> Result<Option<Self>, NumericsError> {
        if !is_noisy(points, geometry, noise) {
            return Ok(None);
        }
        let cloud = points.cloud;
        let cloud = Cloud::new(geometry.feet(cloud, 0..cloud.n_points()), cloud.dimension())?;
        let sampling = Sampling::of(&cloud, observer)?;
        Ok(Some(Self { cloud, sampling }))
    }

    pub(crate) fn placed(&self) -> SampledCloud<'_> {
        SampledCloud { cloud: &self.cloud, sampling: &self.sampling }
    }
}

/// Points with their sampling.
#[derive(Clone, Copy)]
pub(crate) struct SampledCloud<'a> {
    pub cloud: &'a Cloud,
    pub sampling: &'a Sampling,
}

/// Returns whether noise across the surface, L, is such that the points do not tell their sides.
pub(super) fn is_noisy(points: SampledCloud<'_>, geometry: &PatchGeometry, noise: f64) -> bool {
    let scales = points.sampling.scales();
    let step = if points.cloud.dimension() == 2 { scales.nearest } else { scales.spacing };
    noise >= NOISY * step && are_like_noise(&geometry.heights)
}

/// Whether the sizes of heights are spread like those of noise, and not like those of two sheets.
fn are_like_noise(heights: &[f64]) -> bool {
    let mut sizes: Vec<f64> = heights.iter().map(|height| height.abs()).collect();
    sizes.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| sizes.get((share * sizes.len() as f64) as usize).copied().unwrap_or(0.0);
    LIKE_NOISE.iter().all(|(Quantiles { lower, upper }, most)| at(*lower) <= most * at(*upper))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values at the middles of a thousand equal parts of a distribution of sizes.
    fn spread(size_at: impl Fn(f64) -> f64) -> Vec<f64> {
        (0..1000)
            .map(|i| if i % 2 == 0 { 1.0 } else { -1.0 } * size_at((f64::from(i) + 0.5) / 1000.0))
            .collect()
    }

    #[test]
    fn plates_and_lenses_are_no_noise() {
        // The quantile of |h| for exponential tails; its ratios are 0.30 and 0.54.
        assert!(are_like_noise(&spread(|share| -(1.0 - share).ln())));
        assert!(!are_like_noise(&spread(|_| 0.5)));
        assert!(!are_like_noise(&spread(|share| share)));
        // A body of which half is a plate.
        assert!(!are_like_noise(&spread(|share| if share < 0.5 { 1e-3 } else { 0.5 })));
    }
}
