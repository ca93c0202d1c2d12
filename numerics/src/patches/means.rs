//! Data of the regression: the points of a cloud, or means of a few of them.

use std::sync::Arc;

use crate::error::Result;
use crate::machine::heap::vec_bytes;
use crate::observer::Observer;
use crate::points::cells::{Cells, mean, second_moments};
use crate::points::cloud::Cloud;
use crate::points::neighbours::Neighbours;
use crate::points::sampling::Sampling;

/// Points, or means of points, with their neighbours.
///
/// The mean of m points has the m-th part of their noise, and a neighbourhood of equally many means reaches
/// √m times as far. So neighbourhoods grow with the noise at the same cost. Polynomials of second order are
/// averaged exactly, by the second moments of the points about their mean.
pub(crate) enum Support {
    Points { cloud: Arc<Cloud>, sampling: Arc<Sampling> },
    Means(Means),
}

pub(crate) struct Means {
    /// Most points of a mean.
    group: usize,
    cloud: Cloud,
    neighbours: Neighbours,
    /// Number of points of each mean, `[n]`.
    counts: Vec<f64>,
    /// Second moments of the points about their mean, divided by their number, unit L². Upper triangles,
    /// `[n, d(d+1)/2]`.
    moments: Vec<f64>,
}

impl Support {
    /// Takes the points themselves for a group of 1, and means of at most `group` points otherwise.
    ///
    /// # Errors
    /// `NumericsError::Cancelled`.
    pub(crate) fn of(
        group: usize,
        cloud: Arc<Cloud>,
        sampling: Arc<Sampling>,
        observer: &dyn Observer,
    ) -> Result<Self> {
        if group == 1 { Ok(Self::Points { cloud, sampling }) } else { Self::means(&cloud, group, observer) }
    }

    fn means(cloud: &Cloud, group: usize, observer: &dyn Observer) -> Result<Self> {
        let d = cloud.dimension();
        let (mut coordinates, mut counts, mut moments) = (Vec::new(), Vec::new(), Vec::new());
        for cell in Cells::of_all(cloud, group).iter() {
            let mean = mean(cloud, cell);
            let second = second_moments(cloud, cell, &mean);
            moments.extend((0..d).flat_map(|a| (a..d).map(move |b| a * d + b)).map(|at| second[at]));
            coordinates.extend_from_slice(&mean);
            counts.push(cell.len() as f64);
        }
        let cloud = Cloud::new(coordinates, d)?;
        let neighbours = Neighbours::of(&cloud, observer)?;
        Ok(Self::Means(Means { group, cloud, neighbours, counts, moments }))
    }

    /// Returns the most points of a mean, 1 where the data are points.
    pub(crate) fn points_per_mean(&self) -> usize {
        match self {
            Self::Points { .. } => 1,
            Self::Means(means) => means.group,
        }
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

    /// Number of points behind one mean, 1 for a point.
    pub(crate) fn count(&self, at: usize) -> f64 {
        match self {
            Self::Points { .. } => 1.0,
            Self::Means(means) => means.counts[at],
        }
    }

    /// Returns `uᵀMv`, M the second moments of a mean, or 0 for a point.
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

    /// Returns whether the data are means, which have second moments.
    pub(crate) fn has_moments(&self) -> bool {
        matches!(self, Self::Means(_))
    }

    /// Bytes held on the heap besides the cloud and its sampling.
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
