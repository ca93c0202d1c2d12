//! Coverage of error bars: the share of true values within them, row by row of a table.

#![allow(dead_code, reason = "the example prints what the test does not ask")]

use std::sync::Arc;

use gramian_numerics::observer::Unobserved;
use gramian_numerics::patches::Patches;
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling as Spacings;
use gramian_numerics::surface::local::sure::least_ratio;

use crate::common::random::Random;
use crate::sampling::{Sampling, sample};
use crate::shapes::{Shape, Truth, cross, dot, principal_curvatures};

pub const NOISES: [f64; 5] = [0.0, 0.002, 0.005, 0.01, 0.02];

/// Deviations within which 95 % of normally distributed errors lie.
const BAND: f64 = 1.96;

/// A surface, its sampling, and the standard deviation of the noise per coordinate,
/// relative to a radius of about 1.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    pub shape: Shape,
    pub sampling: Sampling,
    pub n_points: usize,
    pub noise: f64,
}

/// Errors, error bars and flags of all points of a row.
#[derive(Debug, Clone, Default)]
pub struct Row {
    /// Errors over 1.96 deviations, by point: of the normal, the mean and both principal curvatures.
    pub ratios: [Vec<f64>; 4],
    /// Larger error of a principal curvature over the larger true curvature, by point.
    pub errors: Vec<f64>,
    /// Angles between found and true normals, radians, by point.
    pub angles: Vec<f64>,
    pub n_flagged: usize,
    /// Points without a flag whose curvatures are off by more than half.
    pub n_off: usize,
}

impl Case {
    /// Runs the case on `n_clouds` clouds and collects all their points.
    pub fn run(&self, n_clouds: usize) -> Row {
        let mut row = Row::default();
        for cloud in 0..n_clouds {
            self.run_once(cloud, &mut row);
        }
        row
    }

    fn run_once(&self, cloud: usize, row: &mut Row) {
        // The seed ignores the noise, so the underlying points are the same for every noise.
        let seed = 31 * self.n_points + 7 * self.sampling as usize + 1001 * cloud;
        let mut random = Random(seed as u64);
        let points = sample(self.shape, self.sampling, self.n_points, &mut random);
        let truths: Vec<Truth> = points.iter().map(|&x| self.shape.truth(x)).collect();
        let mut moved = points.concat();
        moved.iter_mut().for_each(|x| *x += self.noise * random.normal());
        let cloud = Arc::new(Cloud::new(moved, 3).unwrap());
        row.take(&patches(&cloud), &cloud, &truths);
    }
}

impl Row {
    pub fn take(&mut self, patches: &Patches, cloud: &Cloud, truths: &[Truth]) {
        let found = patches.at(cloud, &|_| true, true, &Unobserved).unwrap();
        let deviations = found.curvatures.as_ref().unwrap();
        // Points that are unknown or bent keep the ratio 0: they count as unsure.
        let mut ratios = vec![0.0; truths.len()];
        let first = self.errors.len();
        for (i, truth) in truths.iter().enumerate().filter(|&(i, _)| found.is_known[i]) {
            let normal = <[f64; 3]>::try_from(&found.normals[3 * i..3 * i + 3]).unwrap();
            let form = std::array::from_fn(|a| std::array::from_fn(|b| found.shapes[9 * i + 3 * a + b]));
            let mut curvatures = principal_curvatures(&form, normal);
            let mut bars = [deviations.principal[2 * i], deviations.principal[2 * i + 1]];
            if dot(normal, truth.normal) < 0.0 {
                curvatures = [-curvatures[1], -curvatures[0]];
                bars.reverse();
            }
            let bars = [found.normal_std[i], deviations.mean[i], bars[0], bars[1]];
            if !deviations.is_bent[i] {
                ratios[i] = larger(curvatures) / bars[2].max(bars[3]);
            }
            self.take_point(normal, curvatures, bars, truth);
        }
        let least = least_ratio(&ratios);
        let known = ratios.iter().zip(&found.is_known).filter(|(_, is_known)| **is_known);
        for ((ratio, _), error) in known.zip(&self.errors[first..]) {
            self.n_flagged += usize::from(*ratio < least);
            self.n_off += usize::from(*ratio >= least && *error > 0.5);
        }
    }

    fn take_point(&mut self, normal: [f64; 3], curvatures: [f64; 2], bars: [f64; 4], truth: &Truth) {
        let across = cross(normal, truth.normal);
        let angle = dot(across, across).sqrt().min(1.0).asin();
        let off = [0, 1].map(|i| (curvatures[i] - truth.curvatures[i]).abs());
        let mean = 0.5 * (curvatures[0] + curvatures[1] - truth.curvatures[0] - truth.curvatures[1]).abs();
        for (slot, (error, bar)) in
            self.ratios.iter_mut().zip([angle, mean, off[0], off[1]].into_iter().zip(bars))
        {
            slot.push(error / (BAND * bar));
        }
        let error = larger(off) / larger(truth.curvatures);
        self.angles.push(angle);
        self.errors.push(error);
    }

    /// Percentages of true values within the bars: normal, mean and both principal curvatures.
    pub fn coverages(&self) -> [f64; 4] {
        let share = |ratios: &Vec<f64>| ratios.iter().filter(|&&ratio| ratio <= 1.0).count() as f64;
        self.ratios.each_ref().map(|ratios| 100.0 * share(ratios) / ratios.len().max(1) as f64)
    }

    /// Percentage of points with a flag.
    pub fn flagged(&self) -> f64 {
        100.0 * self.n_flagged as f64 / self.errors.len().max(1) as f64
    }

    pub fn n_unflagged(&self) -> usize {
        self.errors.len() - self.n_flagged
    }

    /// Percentage of the points without a flag whose curvatures are off by half.
    pub fn off(&self) -> f64 {
        100.0 * self.n_off as f64 / self.n_unflagged().max(1) as f64
    }

    /// Whether all coverages are as required: 90 to 99.5 % with noise, at least 85 % without.
    pub fn holds(&self, noise: f64) -> bool {
        let range = if noise > 0.0 { 90.0..=99.5 } else { 85.0..=100.0 };
        self.coverages().iter().all(|coverage| range.contains(coverage))
    }
}

fn larger(pair: [f64; 2]) -> f64 {
    pair[0].abs().max(pair[1].abs())
}

pub fn patches(cloud: &Arc<Cloud>) -> Patches {
    let spacings = Arc::new(Spacings::of(cloud, &Unobserved).unwrap());
    Patches::of(cloud.clone(), spacings, &Unobserved).unwrap()
}

/// The quantile of numbers below which the given share of them lies.
pub fn quantile(numbers: &[f64], share: f64) -> f64 {
    let mut sorted = numbers.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get((share * sorted.len() as f64) as usize).copied().unwrap_or(f64::NAN)
}
