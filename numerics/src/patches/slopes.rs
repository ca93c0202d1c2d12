//! Whether points are inclined to a surface that was regressed over means of them.
//!
//! Means hide from every model what is smaller than they are. The points show it: around a place, the heights
//! of points over the regressed surface have a slope β by least squares. If the surface is right, β has the
//! variance that the noise of the points explains, less what they have in common with the surface (as in
//! `levels`). If the surface has missed a detail, β is its error.

use super::PatchGeometry;
use super::estimate::normal_variance;
use super::level::Level;
use crate::machine::eigen::symmetric_eigen;
use crate::machine::small::{Small, zeros};
use crate::machine::vector::{dot, tangent_basis};
use crate::points::cloud::Cloud;
use crate::points::neighbours::Neighbour;
use crate::points::sampling::median;

/// Least share of places at which the surface is so sure that slopes of the points are informative.
const LEAST_SHARE: f64 = 0.2;

/// Parts of a neighbourhood whose points are looked at, and the greatest slopes over the expected ones at
/// which a surface is taken to be right. On smooth shapes they are 0.8 to 1.2 and 1.0 to 1.4: over more
/// points, slopes tell of finer errors, but third derivatives incline the points as well
/// (docs/error-bars.md).
const LOOKS: [Look; 2] = [Look { part: 0.5, most: 1.2 }, Look { part: 0.8, most: 1.45 }];

#[derive(Clone, Copy)]
struct Look {
    part: f64,
    most: f64,
}

/// Medians of χ² with 1, 2 and 3 degrees of freedom.
const MEDIANS: [f64; 3] = [0.455, 1.386, 2.366];

impl Level {
    /// Returns whether points near these places have larger slopes over a surface than their noise explains,
    /// in the median over the places whose normals are surer than a plane through the points.
    pub(super) fn has_slopes_over(&self, surface: &PatchGeometry, places: &Cloud, noise: f64) -> bool {
        LOOKS.into_iter().any(|look| {
            let slopes = self.slopes_over(surface, places, (look.part * self.count as f64) as usize);
            let excesses: Vec<f64> = slopes.iter().filter_map(|slope| slope.excess(noise)).collect();
            let is_told = excesses.len() as f64 >= LEAST_SHARE * places.n_points() as f64;
            let usual = MEDIANS[places.dimension() - 2];
            is_told && median(excesses).is_some_and(|excess| excess > look.most * usual)
        })
    }

    fn slopes_over(&self, surface: &PatchGeometry, places: &Cloud, count: usize) -> Vec<Slope> {
        let mut near = Vec::new();
        let slope = |at: usize| {
            self.support.neighbours().nearest_into(places.point(at), count, &mut near);
            self.slope_over(surface, at, Near { place: places.point(at), points: &near })
        };
        (0..places.n_points()).filter(|&at| surface.is_known[at]).filter_map(slope).collect()
    }

    /// Returns the slope of points over the surface at one place. `None` where they do not determine it.
    fn slope_over(
        &self,
        surface: &PatchGeometry,
        at: usize,
        Near { place, points }: Near<'_>,
    ) -> Option<Slope> {
        let d = place.len();
        let k = d - 1;
        let normal = &surface.normals[at * d..][..d];
        let shape = &surface.shapes[at * d * d..][..d * d];
        let tangents = tangent_basis(normal);
        let mut sums = Sums::of_axes(k);
        for neighbour in points {
            let point = self.support.cloud().point(neighbour.point);
            let arm: Small = (0..d).map(|c| point[c] - place[c] + surface.heights[at] * normal[c]).collect();
            let along: Small = tangents.chunks_exact(d).map(|tangent| dot(tangent, &arm)).collect();
            let bend: f64 = (0..d).map(|a| arm[a] * dot(&shape[a * d..][..d], &arm)).sum();
            sums.add(&along, dot(normal, &arm) + 0.5 * bend);
        }
        let own = normal_variance(surface.normal_std[at], k);
        sums.fit(own)
    }
}

/// A place with the points next to it.
struct Near<'a> {
    place: &'a [f64],
    points: &'a [Neighbour],
}

/// A slope by least squares.
struct Slope {
    /// |β|².
    square: f64,
    /// Variance of a component of β for heights with unit noise, in the mean over the components.
    unit_variance: f64,
    /// Variance of a component of the normal of the surface.
    own_variance: f64,
}

impl Slope {
    /// Returns |β|² over the variance of a component of β that this noise explains. `None` where the normal
    /// is not surer than that, by half of the variance.
    fn excess(&self, noise: f64) -> Option<f64> {
        let variance = noise * noise * self.unit_variance;
        (self.own_variance < 0.5 * variance).then(|| self.square / (variance - self.own_variance))
    }
}

/// Sums over points near a place: of coordinates c along k axes, and of heights z.
struct Sums {
    n: f64,
    coordinates: Small,
    height: f64,
    products: Small,
    weighted: Small,
}

impl Sums {
    fn of_axes(k: usize) -> Self {
        Self { n: 0.0, coordinates: zeros(k), height: 0.0, products: zeros(k * k), weighted: zeros(k) }
    }

    fn add(&mut self, along: &[f64], height: f64) {
        self.n += 1.0;
        self.height += height;
        for (a, c) in along.iter().enumerate() {
            self.coordinates[a] += c;
            self.weighted[a] += c * height;
            for (b, other) in along.iter().enumerate() {
                self.products[a * along.len() + b] += c * other;
            }
        }
    }

    /// Returns the slope of the heights, with a constant beside it. `None` if the points do not determine it.
    fn fit(&self, own_variance: f64) -> Option<Slope> {
        let k = self.coordinates.len();
        let about_mean = |sum: f64, a: usize, other: f64| sum - self.coordinates[a] * other / self.n;
        let products: Small =
            (0..k * k).map(|at| about_mean(self.products[at], at / k, self.coordinates[at % k])).collect();
        let weighted: Small = (0..k).map(|a| about_mean(self.weighted[a], a, self.height)).collect();
        let (values, vectors) = symmetric_eigen(&products, k);
        let is_determined = values[0] > 1e-6 * values[k - 1];
        let squares = (0..k).map(|i| (dot(&vectors[i * k..][..k], &weighted) / values[i]).powi(2));
        let unit_variance = values[..k].iter().map(|value| 1.0 / value).sum::<f64>() / k as f64;
        is_determined.then(|| Slope { square: squares.sum(), unit_variance, own_variance })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::machine::random::Random;
    use crate::observer::Unobserved;
    use crate::patches::means::Support;
    use crate::points::sampling::Sampling;

    #[test]
    fn slopes_beyond_the_noise_are_found_and_those_of_noise_are_not() {
        let (n, noise) = (1000, 0.1);
        let mut random = Random::of(3, 0);
        let side = f64::sqrt(n as f64);
        let mut heights = vec![0.0; n];
        random.fill_normal(&mut heights);
        let points = heights.iter().flat_map(|height| {
            let [x, y] = [0, 1].map(|_| side * random.uniform());
            [x, y, noise * height]
        });
        let cloud = Arc::new(Cloud::new(points.collect(), 3).unwrap());
        let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
        let support = Support::of(1, cloud.clone(), sampling, &Unobserved).unwrap();
        let level = Level::of(support, noise);
        // 15 points of noise 0.1 have a slope of 0.025, 24 points 0.015.
        for (angle, deviation, has_slopes) in
            [(0.0, 0.001, false), (0.05, 0.001, true), (0.05, 0.05, false), (-0.3, 0.01, true)]
        {
            let plane = PatchGeometry {
                is_known: vec![true; cloud.n_points()],
                normals: cloud.points().flat_map(|_| [f64::sin(angle), 0.0, f64::cos(angle)]).collect(),
                heights: cloud.points().map(|x| x[2]).collect(),
                normal_std: vec![deviation; cloud.n_points()],
                ..PatchGeometry::unknown(cloud.n_points(), 3, false)
            };
            assert_eq!(level.has_slopes_over(&plane, &cloud, noise), has_slopes, "{angle}, {deviation}");
        }
    }
}
