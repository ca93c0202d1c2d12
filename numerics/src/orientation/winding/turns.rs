//! Turning of patches of pieces that point to the wrong side.
//!
//! Where a body is thinner than its points are apart, sure edges lead around its rim from one side to the
//! other. Both sides then point the same way. So a piece is cut into patches, wherever that may be, if
//! winding numbers say that much of it is wrong. Gauss's formula finds the signs of the patches with all
//! others.

use super::field::Field;
use super::gauss::Problem;
use crate::error::NumericsError;
use crate::orientation::edges::{Edge, averaged};
use crate::orientation::parts::Parts;

/// Distance of the winding number from ½ from which a point is on the wrong side or faces one that is. It is
/// averaged over the neighbours on the sheet. With noise of a third of the spacing areas are too large. The
/// distance is then 0.3 and more at half of the points whose sides are right.
const WRONG: f64 = 0.6;

/// Share of points beyond [`WRONG`] from which a piece is cut, and the share that may be left once it is cut.
/// The bunny with 1 % of noise, whose sides are right, has 0.11. A plate with one wrong side has 0.3 and
/// more.
const MUCH: f64 = 0.15;
const LITTLE: f64 = 0.03;

/// Least number of points in question for a cut: of a noisy ellipse of 32 points, single ones were turned
/// over.
const LEAST_WRONG: usize = 100;

/// Number of patches that the points in question make at first, and the factor by which it grows from round
/// to round. A patch that straddles a rim is half wrong until it is small.
const N_PATCHES: f64 = 50.0;
const REFINED: f64 = 1.4;

/// Least number of points of a patch, as far as sure edges join so many.
const LEAST_PATCH: usize = 12;

/// Most rounds. More have changed nothing.
const N_ROUNDS: usize = 8;

/// Largest median of |w − ½| on a patch that is turned. It is larger than on a piece, because others are
/// still wrong.
const ON_PATCH: f64 = 0.4;

/// Largest share of the points in question that one round may turn. Nearly all of them would be the whole
/// surface inside out. A cap of a sphere, which has no inside, is no better for that.
const MOST_TURNED: f64 = 0.75;

/// Result of turning patches.
pub(crate) struct TurnedPatches {
    /// Misfits w − ½ at the points, `[n]`.
    pub misfits: Vec<f64>,
    /// True for each piece of which patches were turned.
    pub is_cut: Vec<bool>,
    /// Points of patches whose better sign is unclear.
    pub unclear: Vec<usize>,
}

/// Turns patches of wrong pieces, smaller ones from round to round, as long as winding numbers improve.
///
/// # Errors
/// [`NumericsError::Cancelled`].
pub(crate) fn turn_patches(
    field: &Field<'_>,
    pieces: &Parts,
    edges: &[Edge],
    signs: &mut [f64],
) -> Result<TurnedPatches, NumericsError> {
    let (misfits, is_cut) = (field.misfits(signs)?, vec![false; pieces.members.len()]);
    let mut so_far = TurnedPatches { misfits, is_cut, unclear: Vec::new() };
    let mut share = 1.0 / N_PATCHES;
    for _ in 0..N_ROUNDS {
        let shares = pieces.shares(&averaged(edges, &so_far.misfits), |misfit| misfit > WRONG);
        let is_wrong = |point: usize| {
            let piece = pieces.of_point[point];
            shares[piece] > if so_far.is_cut[piece] { LITTLE } else { MUCH }
        };
        let n_wrong = (0..signs.len()).filter(|&point| is_wrong(point)).count();
        if n_wrong < LEAST_WRONG {
            break;
        }
        let most = (share * n_wrong as f64) as usize;
        let patches = Parts::along_sure(edges, signs, most.max(LEAST_PATCH));
        let wanted = by_misfit(&patches, &so_far.misfits, is_wrong);
        let problem = Problem::of(field, &patches, &wanted, signs)?.with_springs(&patches, edges, signs);
        let turned = problem.turned(ON_PATCH);
        let n_turned = patches.points_of(&turned).count();
        if turned.is_empty() || n_turned as f64 > MOST_TURNED * n_wrong as f64 {
            break;
        }
        so_far.unclear.extend(patches.points_of(&problem.unclear(&turned)));
        patches.points_of(&turned).for_each(|point| so_far.is_cut[pieces.of_point[point]] = true);
        let mut followers = followers(&patches, edges, signs, &turned);
        followers.retain(|&patch| !problem.asks_for(patch));
        patches.turn(&turned, signs);
        patches.turn(&followers, signs);
        so_far.misfits = field.misfits(signs)?;
        share /= REFINED;
    }
    Ok(so_far)
}

/// Returns patches of wrong points, those with the largest sums of misfits first.
fn by_misfit(patches: &Parts, misfits: &[f64], is_wrong: impl Fn(usize) -> bool) -> Vec<usize> {
    let sum = |points: &[usize]| -> f64 { points.iter().map(|&point| misfits[point].abs()).sum() };
    let sums: Vec<f64> = patches.members.iter().map(|points| sum(points)).collect();
    let mut wanted = patches.by_size();
    wanted.retain(|&patch| patches.members[patch].first().is_some_and(|&point| is_wrong(point)));
    // The sort is stable, so that ties are ordered by size.
    wanted.sort_by(|&a, &b| sums[b].total_cmp(&sums[a]));
    wanted
}

/// Finds parts next to turned ones that most of their edges would turn as well.
fn followers(parts: &Parts, edges: &[Edge], signs: &[f64], turned: &[usize]) -> Vec<usize> {
    let n_parts = parts.members.len();
    let (mut is_turned, mut is_next, mut votes) =
        (vec![false; n_parts], vec![false; n_parts], vec![0.0; n_parts]);
    turned.iter().for_each(|&part| is_turned[part] = true);
    for edge in edges {
        let (a, b) = (parts.of_point[edge.a()], parts.of_point[edge.b()]);
        for (own, other) in [(a, b), (b, a)].into_iter().filter(|(own, other)| own != other) {
            let sign = if is_turned[other] { -1.0 } else { 1.0 };
            votes[own] += sign * edge.agreement(signs);
            is_next[own] |= is_turned[other];
        }
    }
    (0..n_parts).filter(|&part| is_next[part] && votes[part] < 0.0).collect()
}
