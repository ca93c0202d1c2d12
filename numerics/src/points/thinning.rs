//! Thinning: fewer points that are spread as the cloud is.

use super::cells::halve;
use super::cloud::Cloud;
use crate::error::Result;
use crate::observer::Observer;

/// Greatest number of points of the coarse cloud. Factorizing 6,000 takes a second and a half on two cores.
/// With 4,000, thin parts of a scan have a third more normals on the wrong side.
const MAX_COARSE: usize = 6000;

/// Points of the cloud per point of the coarse one, if that leaves more than [`LEAST_COARSE`].
const POINTS_PER_COARSE: usize = 6;
/// Least number of points of the coarse cloud, for clouds that have as many.
const LEAST_COARSE: usize = 600;

/// Returns the number of points of the coarse cloud for a cloud of `n_points`.
pub(crate) fn n_coarse(n_points: usize) -> usize {
    (n_points / POINTS_PER_COARSE).clamp(LEAST_COARSE, MAX_COARSE).min(n_points)
}

/// Returns at most `count` points of a cloud, spread as the cloud is; ascending.
///
/// The cloud is halved again and again into parts with equally many points, as many as points are wanted.
/// Each part contributes the point in the middle along its last halving.
///
/// # Errors
/// [`crate::error::NumericsError::Cancelled`].
pub(crate) fn thinned_points(cloud: &Cloud, count: usize, observer: &dyn Observer) -> Result<Vec<usize>> {
    let n = cloud.n_points();
    if count >= n {
        return Ok((0..n).collect());
    }
    let mut order: Vec<u32> = (0..n as u32).collect();
    let mut choice = Choice { cloud, observer, chosen: Vec::with_capacity(count) };
    choice.choose(&mut order, count.max(1))?;
    choice.chosen.sort_unstable();
    Ok(choice.chosen)
}

/// Points from which on a halving has a checkpoint of its own.
const CHECKED: usize = 1 << 12;

/// Points that are chosen one after the other.
struct Choice<'a> {
    cloud: &'a Cloud,
    observer: &'a dyn Observer,
    chosen: Vec<usize>,
}

impl Choice<'_> {
    /// Chooses `count` of these points.
    fn choose(&mut self, points: &mut [u32], count: usize) -> Result<()> {
        if count == 0 || points.is_empty() {
            return Ok(());
        }
        if points.len() >= CHECKED {
            self.observer.checkpoint()?;
        }
        if count == 1 {
            let middle = (points.len() - 1) / 2;
            let chosen = halve(self.cloud, points, middle).1.first();
            self.chosen.extend(chosen.map(|&point| point as usize));
            return Ok(());
        }
        let middle = points.len().div_ceil(2);
        let (left, right) = halve(self.cloud, points, middle);
        self.choose(left, count.div_ceil(2))?;
        self.choose(right, count / 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::Unobserved;
    use crate::testing::fibonacci_sphere;

    #[test]
    fn thinned_clouds_have_as_many_points_as_asked_for_all_over() {
        let cloud = fibonacci_sphere(1000);
        for count in [1, 2, 7, 100, 999] {
            let few = thinned_points(&cloud, count, &Unobserved).unwrap();
            assert_eq!(few.len(), count);
            assert!(few.windows(2).all(|pair| pair[0] < pair[1]) && few.iter().all(|&point| point < 1000));
        }
        assert_eq!(thinned_points(&cloud, 2000, &Unobserved).unwrap().len(), 1000);
        let few = cloud.select(&thinned_points(&cloud, 100, &Unobserved).unwrap());
        let n_near = |x: &[f64]| {
            few.points().filter(|y| x.iter().zip(*y).map(|(a, b)| a * b).sum::<f64>() > 0.8).count()
        };
        // A tenth of the sphere lies within that angle.
        assert!(cloud.points().all(|x| (4..=17).contains(&n_near(x))));
    }

    #[test]
    fn copies_of_one_point_are_thinned_too() {
        let cloud = Cloud::new(vec![1.0; 30], 3).unwrap();
        assert_eq!(thinned_points(&cloud, 4, &Unobserved).unwrap().len(), 4);
    }
}
