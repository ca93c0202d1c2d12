//! Signs of parts of a surface by Gauss's formula: the winding number is ½ on a closed surface itself.
//!
//! The problem is `W s = ½` over a sample of points x, where W[x, j] is what part j with its present signs
//! contributes at x. It is solved for real s by least squares with a ridge towards the present signs, s = 1,
//! and rounded. Then parts are turned one by one as long as that brings the sums nearer to ½. Edges between
//! parts are springs that hold their signs together.

use rayon::prelude::*;

use super::dipoles::Dipoles;
use super::field::Field;
use crate::error::NumericsError;
use crate::orientation::edges::Edge;
use crate::orientation::parts::Parts;
use crate::points::sampling::median;

/// Most parts whose signs are unknown. Other parts keep their signs.
const MAX_UNKNOWN: usize = 150;

/// Points in the sample for all parts together, and least number of points for each part.
const N_SAMPLES: usize = 800;
const LEAST_SAMPLES: usize = 8;

/// Weight of the present signs, per point of the sample.
const RIDGE: f64 = 1e-3;

/// Weight of an edge between two parts, relative to a point of the sample.
const SPRING: f64 = 0.05;

/// Least decrease of the sum of squares for a single part to be turned: a twentieth of a point on the wrong
/// side.
const LEAST_GAIN: f64 = 0.05;

/// Change of w from which a point of the sample is a witness, and the least number of witnesses.
const WITNESS: f64 = 0.2;
const LEAST_WITNESSES: usize = 3;

/// Largest part of the squares of witnesses that may remain for new signs to be clearly better. Signs that
/// fit what is random in the winding numbers of a thin body leave more.
const CLEARLY: f64 = 0.3;

/// Remaining part of the squares of its witnesses from which the sign of a single part is unclear.
const UNCLEAR: f64 = 0.5;

/// The problem `W s = b` for the signs of some parts relative to their present ones.
///
/// The right-hand side b is ½ less what all other points contribute.
pub(crate) struct Problem {
    unknown: Vec<usize>,
    /// W, `[rows, unknown]`.
    matrix: Vec<f64>,
    right: Vec<f64>,
    /// Index of the unknown part that the point of each row is on.
    on: Vec<usize>,
    /// Springs between the unknown parts, `[unknown, unknown]`, negative where edges contradict the present
    /// signs.
    springs: Vec<f64>,
}

impl Problem {
    /// Sets up the problem of these parts, or of the first ones if there are too many.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(crate) fn of(
        field: &Field<'_>,
        parts: &Parts,
        wanted: &[usize],
        signs: &[f64],
    ) -> Result<Self, NumericsError> {
        let unknown = wanted[..wanted.len().min(MAX_UNKNOWN)].to_vec();
        let mut is_unknown = vec![false; parts.members.len()];
        unknown.iter().for_each(|&part| is_unknown[part] = true);
        let known: Vec<usize> =
            (0..signs.len()).filter(|&point| !is_unknown[parts.of_point[point]]).collect();
        let moments = field.moments(signs);
        let tree = |points: &[usize]| Dipoles::of(&field.cloud, &moments, points);
        let trees: Vec<Dipoles> = unknown.par_iter().map(|&part| tree(&parts.members[part])).collect();
        let rest = tree(&known);
        let samples = samples(parts, &unknown);
        let row = |sample: &Sample| {
            field.observer.checkpoint()?;
            let x = field.cloud.point(sample.point);
            let row: Vec<f64> = trees.iter().map(|tree| tree.winding(x)).collect();
            Ok((row, 0.5 - rest.winding(x)))
        };
        let rows: Result<Vec<(Vec<f64>, f64)>, NumericsError> = samples.par_iter().map(row).collect();
        let (rows, right): (Vec<_>, Vec<_>) = rows?.into_iter().unzip();
        let on = samples.iter().map(|sample| sample.on).collect();
        let springs = vec![0.0; unknown.len() * unknown.len()];
        Ok(Self { unknown, matrix: rows.concat(), right, on, springs })
    }

    /// Adds springs where edges lead from one part to another.
    pub(crate) fn with_springs(mut self, parts: &Parts, edges: &[Edge], signs: &[f64]) -> Self {
        let m = self.unknown.len();
        let mut place = vec![usize::MAX; parts.members.len()];
        self.unknown.iter().enumerate().for_each(|(at, &part)| place[part] = at);
        for edge in edges {
            let (a, b) = (place[parts.of_point[edge.a()]], place[parts.of_point[edge.b()]]);
            if a != b && a != usize::MAX && b != usize::MAX {
                let spring = SPRING * edge.agreement(signs);
                self.springs[a * m + b] += spring;
                self.springs[b * m + a] += spring;
            }
        }
        self
    }

    /// Finds the parts that point to the wrong side, if turning them clearly brings the winding numbers
    /// nearer to ½.
    ///
    /// Parts are returned only if the median of |w − ½| on them becomes `at_most` or less.
    pub(crate) fn turned(&self, at_most: f64) -> Vec<usize> {
        let present = vec![1.0; self.unknown.len()];
        let mut found: Vec<f64> =
            self.least_squares().iter().map(|s| if *s < 0.0 { -1.0 } else { 1.0 }).collect();
        self.descend(&mut found);
        let mut nearby = present.clone();
        self.descend(&mut nearby);
        let best = if self.misfit(&nearby) <= self.misfit(&found) { nearby } else { found };
        if !self.is_clearly_better(&best, &present) {
            return Vec::new();
        }
        let misfits = self.median_misfits(&best);
        let is_turned = |&at: &usize| best[at] < 0.0 && misfits[at] <= at_most;
        (0..best.len()).filter(is_turned).map(|at| self.unknown[at]).collect()
    }

    /// Returns whether the sign of a part was asked for.
    pub(crate) fn asks_for(&self, part: usize) -> bool {
        self.unknown.contains(&part)
    }

    fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.matrix.chunks_exact(self.unknown.len().max(1))
    }

    /// Returns b − W s, row by row.
    fn residual(&self, signs: &[f64]) -> Vec<f64> {
        let product = |row: &[f64]| row.iter().zip(signs).map(|(w, s)| w * s).sum::<f64>();
        self.rows().zip(&self.right).map(|(row, b)| b - product(row)).collect()
    }

    /// Returns the sum of squares of the residual. No square counts for more than a wrong side.
    fn misfit(&self, signs: &[f64]) -> f64 {
        self.residual(signs).iter().map(|r| (r * r).min(1.0)).sum()
    }

    /// Returns whether the rows that see a difference between two choices of signs are clearly for the first
    /// one.
    fn is_clearly_better(&self, signs: &[f64], present: &[f64]) -> bool {
        remaining(&self.residual(signs), &self.residual(present)).is_some_and(|part| part <= CLEARLY)
    }

    /// Finds the parts whose signs are not clearly better than the opposite ones, once some are turned.
    pub(crate) fn unclear(&self, turned: &[usize]) -> Vec<usize> {
        let sign = |part: &usize| if turned.contains(part) { -1.0 } else { 1.0 };
        let signs: Vec<f64> = self.unknown.iter().map(sign).collect();
        let residual = self.residual(&signs);
        let is_unclear = |&at: &usize| {
            let opposite = self.rows().zip(&residual).map(|(row, r)| r + 2.0 * signs[at] * row[at]);
            remaining(&residual, &opposite.collect::<Vec<f64>>()).is_some_and(|part| part > UNCLEAR)
        };
        (0..signs.len()).filter(is_unclear).map(|at| self.unknown[at]).collect()
    }

    /// Returns the median magnitude of the residual on each part.
    fn median_misfits(&self, signs: &[f64]) -> Vec<f64> {
        let mut on_parts = vec![Vec::new(); self.unknown.len()];
        self.residual(signs).iter().zip(&self.on).for_each(|(r, &on)| on_parts[on].push(r.abs()));
        on_parts.into_iter().map(|misfits| median(misfits).unwrap_or(f64::INFINITY)).collect()
    }

    /// Turns parts one by one while that lowers the sum of squares. Eight rounds have always been enough.
    fn descend(&self, signs: &mut [f64]) {
        let mut residual = self.residual(signs);
        for _ in 0..8 {
            let mut has_changed = false;
            for part in 0..signs.len() {
                let step = 2.0 * signs[part];
                let change = |(row, r): (&[f64], &f64)| step * row[part] * (2.0 * r + step * row[part]);
                let change = self.rows().zip(&residual).map(change).sum::<f64>() + self.tension(part, signs);
                if change < -LEAST_GAIN {
                    self.rows().zip(&mut residual).for_each(|(row, r)| *r += step * row[part]);
                    signs[part] = -signs[part];
                    has_changed = true;
                }
            }
            if !has_changed {
                return;
            }
        }
    }

    /// Returns the energy that the springs of a part take up if it is turned: `4 Σ_q c_pq s_p s_q`.
    fn tension(&self, part: usize, signs: &[f64]) -> f64 {
        let springs = &self.springs[part * signs.len()..][..signs.len()];
        4.0 * signs[part] * springs.iter().zip(signs).map(|(spring, s)| spring * s).sum::<f64>()
    }

    /// Minimises `|W s − b|² + Σ_{p<q} |c_pq| (s_p ∓ s_q)² + ridge |s − 1|²` by Cholesky factorization of its
    /// normal equations.
    fn least_squares(&self) -> Vec<f64> {
        let m = self.unknown.len();
        let ridge = RIDGE * self.right.len() as f64;
        let (mut normal, mut s): (Vec<f64>, _) = (self.springs.iter().map(|c| -c).collect(), vec![ridge; m]);
        for (row, b) in self.rows().zip(&self.right) {
            for i in 0..m {
                s[i] += row[i] * b;
                (0..=i).for_each(|j| normal[i * m + j] += row[i] * row[j]);
            }
        }
        for i in 0..m {
            normal[i * m + i] += ridge + self.springs[i * m..][..m].iter().map(|c| c.abs()).sum::<f64>();
        }
        solve(&mut normal, &mut s);
        s
    }
}

/// Returns the sum of squared residuals after a change over that before it, on the witnesses of the change.
///
/// No square counts for more than a wrong side. `None` if there are too few witnesses.
fn remaining(after: &[f64], before: &[f64]) -> Option<f64> {
    let witnesses = after.iter().zip(before).filter(|(a, b)| (*a - *b).abs() > WITNESS);
    let (mut sum_after, mut sum_before, mut count) = (0.0, 0.0, 0);
    for (a, b) in witnesses {
        sum_after += (a * a).min(1.0);
        sum_before += (b * b).min(1.0);
        count += 1;
    }
    (count >= LEAST_WITNESSES).then(|| sum_after / sum_before)
}

/// A point at which winding numbers are looked at, and the unknown part that it is on.
struct Sample {
    point: usize,
    on: usize,
}

/// Samples points of each unknown part, spread over its list.
fn samples(parts: &Parts, unknown: &[usize]) -> Vec<Sample> {
    let total: usize = unknown.iter().map(|&part| parts.members[part].len()).sum();
    let of_part = |(on, &part): (usize, &usize)| {
        let members = &parts.members[part];
        let share = N_SAMPLES * members.len() / total.max(1);
        let count = share.clamp(LEAST_SAMPLES, N_SAMPLES).min(members.len());
        (0..count).map(move |i| Sample { point: members[i * members.len() / count], on })
    };
    unknown.iter().enumerate().flat_map(of_part).collect()
}

/// Solves a positive definite system, given by its lower triangle, in place.
fn solve(a: &mut [f64], b: &mut [f64]) {
    let m = b.len();
    for i in 0..m {
        for j in 0..=i {
            let below: f64 = (0..j).map(|k| a[i * m + k] * a[j * m + k]).sum();
            let rest = a[i * m + j] - below;
            a[i * m + j] = if i == j { rest.max(f64::MIN_POSITIVE).sqrt() } else { rest / a[j * m + j] };
        }
        b[i] = (b[i] - (0..i).map(|k| a[i * m + k] * b[k]).sum::<f64>()) / a[i * m + i];
    }
    for i in (0..m).rev() {
        b[i] = (b[i] - (i + 1..m).map(|k| a[k * m + i] * b[k]).sum::<f64>()) / a[i * m + i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positive_definite_systems_are_solved() {
        let full = [4.0, 2.0, 0.5, 2.0, 5.0, 1.0, 0.5, 1.0, 3.0];
        let mut b = [1.0, -2.0, 3.0];
        solve(&mut full.clone(), &mut b);
        for (row, expected) in full.chunks(3).zip([1.0, -2.0, 3.0]) {
            assert!((row.iter().zip(&b).map(|(a, x)| a * x).sum::<f64>() - expected).abs() < 1e-14);
        }
    }
}
