//! What a surface is regressed on: the points of a cloud, or means of a few of them.

use std::sync::Arc;

use crate::numerics::error::NumericsError;
use crate::numerics::machine::heap::vec_bytes;
use crate::numerics::observer::Observer;
use crate::numerics::points::cells::Cells;
use crate::numerics::points::cloud::Cloud;
use crate::numerics::points::neighbours::Neighbours;
use crate::numerics::points::sampling::Sampling;

/// Points, or means of points, with their neighbours.
///
/// The mean of m points has the m-th part of their noise, and a neighbourhood of so many means reaches √m times as far: that is how
/// neighbourhoods grow with the noise at the same cost. Polynomials of second order are averaged exactly, by the second moments
/// of the points about their mean.
pub(crate) enum Support {
    Points { cloud: Arc<Cloud>, sampling: Arc<Sampling> },
    Means(Means),
}

pub(crate) struct Means {
    cloud: Cloud,
    neighbours: Neighbours,
    /// Points of each mean, `[n]`.
    counts: Vec<f64>,
    /// Second moments about it, over the count, upper triangles `[n, d(d+1)/2]`, unit L².
    moments: Vec<f64>,
}

impl Support {
    /// Means of cells of at most `group` points.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(crate) fn means(cloud: &Cloud, group: usize, observer: &dyn Observer) -> Result<Self, NumericsError> {
        let d = cloud.dimension();
        let mut found = Gathered::default();
        Cells::of_all(cloud, group).iter().for_each(|cell| gather(cloud, cell, &mut found));
        let cloud = Cloud::new(found.coordinates, d)?;
        let neighbours = Neighbours::of(&cloud, observer)?;
        Ok(Self::Means(Means { cloud, neighbours, counts: found.counts, moments: found.moments }))
    }

    pub(crate) fn cloud(&self) -> &Cloud {
        match self {
            Self::Points { cloud, .. } => cloud,
            Self::Means(means) => &means.cloud,
        }
    }

    pub(crate) fn neighbours(&self) -> &Neighbours {
        match self {
            Self::Points { sampling, .. } => sampling.neighbours(),
            Self::Means(means) => &means.neighbours,
        }
    }

    /// Points per mean: 1 for points.
    pub(crate) fn count(&self, at: usize) -> f64 {
        match self {
            Self::Points { .. } => 1.0,
            Self::Means(means) => means.counts[at],
        }
    }

    /// `uᵀMv` of the second moments M of a mean.
    pub(crate) fn moment(&self, at: usize, u: &[f64], v: &[f64]) -> f64 {
        let Self::Means(means) = self else { return 0.0 };
        let d = u.len();
        let moments = &means.moments[at * d * (d + 1) / 2..];
        let (mut sum, mut next) = (0.0, 0);
        for a in 0..d {
            sum += moments[next] * u[a] * v[a];
            next += 1;
            for b in a + 1..d {
                sum += moments[next] * (u[a] * v[b] + u[b] * v[a]);
                next += 1;
            }
        }
        sum
    }

    /// Whether its points stand for several of the cloud.
    pub(crate) fn has_moments(&self) -> bool {
        matches!(self, Self::Means(_))
    }

    /// Bytes held on the heap beside the cloud and its sampling.
    pub(crate) fn n_bytes(&self) -> usize {
        match self {
            Self::Points { .. } => 0,
            Self::Means(means) => {
                means.cloud.n_bytes()
                    + means.neighbours.n_bytes()
                    + vec_bytes(&means.counts)
                    + vec_bytes(&means.moments)
            }
        }
    }
}

#[derive(Default)]
struct Gathered {
    coordinates: Vec<f64>,
    counts: Vec<f64>,
    moments: Vec<f64>,
}

fn gather(cloud: &Cloud, points: &[u32], found: &mut Gathered) {
    let (d, count) = (cloud.dimension(), points.len() as f64);
    let start = found.coordinates.len();
    // About the first point, so that no digit is lost far from the origin.
    let origin = cloud.point(points[0] as usize);
    let arms =
        || points.iter().map(|&point| cloud.point(point as usize).iter().zip(origin).map(|(x, o)| x - o));
    found.coordinates.extend(std::iter::repeat_n(0.0, d));
    for arm in arms() {
        found.coordinates[start..].iter_mut().zip(arm).for_each(|(mean, x)| *mean += x / count);
    }
    let mean: Vec<f64> = found.coordinates[start..].to_vec();
    for a in 0..d {
        for b in a..d {
            let product = |arm: Vec<f64>| (arm[a] - mean[a]) * (arm[b] - mean[b]);
            found.moments.push(arms().map(|arm| product(arm.collect())).sum::<f64>() / count);
        }
    }
    found.coordinates[start..].iter_mut().zip(origin).for_each(|(mean, o)| *mean += o);
    found.counts.push(count);
}
