//! Sides by winding numbers: pieces that are turned, and points whose sides stay ambiguous.

use super::edges::Edge;
use super::field::Field;
use super::gauss::Problem;
use super::parts::Parts;
use crate::numerics::error::NumericsError;

/// Distance of the winding number from ½, averaged over the neighbours on the sheet, beyond which a side is
/// ambiguous.
const DOUBT: f64 = 0.3;

/// Blame for the misfits of others beyond which a side is ambiguous: a wrong sheet of which half of the space
/// is seen has ½.
const BLAME: f64 = 0.25;

/// Share of the edges of a point, by weight, that may contradict its side.
const CONTRADICTED: f64 = 0.5;

/// Distance from ½ within which a part of the points of a piece must be for it to bound something, with the
/// others: no such point is on a flat sheet or half a sphere, half of them are on a plate one side of which
/// is wrong.
const BOUNDS: f64 = 0.15;
const BOUNDING_SHARE: f64 = 0.2;

/// Distance from ½, and the share of the points of a closed piece that may exceed it.
const CLOSED: f64 = 0.2;
const MAX_OFF: f64 = 0.03;

/// Share of the points of a piece in doubt from which parts of it may point to different sides.
const SUSPICIOUS: f64 = 0.05;

/// Points of a piece or a part, and share of the points asked about, below which its sign is not asked for:
/// what it contributes to winding numbers is less than what they are off. Parts of 14 points of a noisy scan
/// of 1,839 were turned over, and single points of a noisy ellipse of 32.
const LEAST_PIECE: usize = 12;
const LEAST_PART: f64 = 0.02;

/// Median of |w − ½| on a piece that is turned, at most: on a cap of a sphere, which has no inside, it is
/// 0.2. Parts of thin plates need more.
const ON_PIECE: f64 = 0.12;
const ON_PART: f64 = 0.2;

/// What winding numbers say of a cloud.
pub(super) struct Sides {
    /// Whether what is known of the side of a point contradicts itself, `[n]`.
    pub is_ambiguous: Vec<bool>,
    /// Whether each piece is closed, with the others.
    pub is_closed: Vec<bool>,
}

/// Turns pieces and parts of them that point to the wrong side, and tells what is left.
///
/// # Errors
/// [`NumericsError::Cancelled`].
pub(super) fn settle(
    field: &Field<'_>,
    pieces: &Parts,
    edges: &[Edge],
    signs: &mut [f64],
) -> Result<Sides, NumericsError> {
    let mut large = pieces.by_size();
    large.retain(|&piece| pieces.members[piece].len() >= LEAST_PIECE);
    let turned = Problem::of(field, pieces, &large, signs)?.turned(ON_PIECE);
    turn(pieces, &turned, signs);
    let mut misfits = field.misfits(signs)?;
    let in_doubt = shares(pieces, &misfits, |misfit| misfit > DOUBT);
    let is_suspicious = |point: usize| in_doubt[pieces.of_point[point]] > SUSPICIOUS;
    let undecided = turn_parts(field, edges, signs, is_suspicious)?;
    if undecided.is_some() {
        misfits = field.misfits(signs)?;
    }
    let near = shares(pieces, &misfits, |misfit| misfit <= BOUNDS);
    let off = shares(pieces, &misfits, |misfit| misfit > CLOSED);
    let tallies = tallies(edges, signs, &misfits);
    let doubt = |(point, tally): (usize, &Tally)| {
        let misfit = tally.misfit / tally.count;
        let bounds = near[pieces.of_point[point]] >= BOUNDING_SHARE;
        if bounds && misfit.abs() > DOUBT { misfit } else { 0.0 }
    };
    let doubts: Vec<f64> = tallies.iter().enumerate().map(doubt).collect();
    let blames = field.blames(signs, &doubts)?;
    let is_ambiguous = |((doubt, blame), tally): ((&f64, &f64), &Tally)| {
        *doubt != 0.0 || *blame > BLAME || tally.against > CONTRADICTED * tally.weight
    };
    let mut is_ambiguous: Vec<bool> = doubts.iter().zip(&blames).zip(&tallies).map(is_ambiguous).collect();
    undecided.into_iter().flatten().for_each(|point| is_ambiguous[point] = true);
    Ok(Sides { is_ambiguous, is_closed: off.iter().map(|share| *share <= MAX_OFF).collect() })
}

/// Multiplies the signs of the points of some parts with −1.
fn turn(parts: &Parts, turned: &[usize], signs: &mut [f64]) {
    for &part in turned {
        parts.members[part].iter().for_each(|&point| signs[point] = -signs[point]);
    }
}

/// The share of the points of each piece with such magnitudes of their misfits.
fn shares(pieces: &Parts, misfits: &[f64], is_such: impl Fn(f64) -> bool) -> Vec<f64> {
    let share = |points: &Vec<usize>| {
        let count = points.iter().filter(|&&point| is_such(misfits[point].abs())).count();
        count as f64 / points.len() as f64
    };
    pieces.members.iter().map(share).collect()
}

/// Turns parts of suspicious pieces, which no sure edge joins to the rest, and returns the points of these
/// pieces that are on parts too small to be asked; `None` if no part is turned.
///
/// # Errors
/// [`NumericsError::Cancelled`].
fn turn_parts(
    field: &Field<'_>,
    edges: &[Edge],
    signs: &mut [f64],
    is_suspicious: impl Fn(usize) -> bool,
) -> Result<Option<Vec<usize>>, NumericsError> {
    if !(0..signs.len()).any(&is_suspicious) {
        return Ok(None);
    }
    let parts = Parts::along_sure(edges, signs);
    let mut wanted = parts.by_size();
    wanted.retain(|&part| parts.members[part].first().is_some_and(|&point| is_suspicious(point)));
    let n_wanted: usize = wanted.iter().map(|&part| parts.members[part].len()).sum();
    let least = (LEAST_PART * n_wanted as f64).max(LEAST_PIECE as f64);
    let is_large = |part: &usize| parts.members[*part].len() as f64 >= least;
    let large: Vec<usize> = wanted.iter().copied().filter(is_large).collect();
    let problem = Problem::of(field, &parts, &large, signs)?.with_springs(&parts, edges, signs);
    let turned = problem.turned(ON_PART);
    // All of them would be the whole surface, inside out.
    if turned.is_empty() || turned.len() == large.len() {
        return Ok(None);
    }
    let mut followers = followers(&parts, edges, signs, &turned);
    followers.retain(|&part| !problem.asks_for(part));
    turn(&parts, &turned, signs);
    turn(&parts, &followers, signs);
    wanted.retain(|&part| !problem.asks_for(part));
    Ok(Some(wanted.iter().flat_map(|&part| parts.members[part].iter().copied()).collect()))
}

/// Parts next to turned ones that most of their edges would have follow.
fn followers(parts: &Parts, edges: &[Edge], signs: &[f64], turned: &[usize]) -> Vec<usize> {
    let n_parts = parts.members.len();
    let (mut is_turned, mut is_next, mut votes) =
        (vec![false; n_parts], vec![false; n_parts], vec![0.0; n_parts]);
    turned.iter().for_each(|&part| is_turned[part] = true);
    for edge in edges {
        let (a, b) = (parts.of_point[edge.a], parts.of_point[edge.b]);
        for (own, other) in [(a, b), (b, a)].into_iter().filter(|(own, other)| own != other) {
            let sign = if is_turned[other] { -1.0 } else { 1.0 };
            votes[own] += sign * edge.agreement(signs);
            is_next[own] |= is_turned[other];
        }
    }
    (0..n_parts).filter(|&part| is_next[part] && votes[part] < 0.0).collect()
}

/// What is summed up over a point and its neighbours on the sheet.
#[derive(Clone, Copy)]
struct Tally {
    misfit: f64,
    count: f64,
    weight: f64,
    /// The weight of the edges that contradict.
    against: f64,
}

fn tallies(edges: &[Edge], signs: &[f64], misfits: &[f64]) -> Vec<Tally> {
    let alone = |misfit: &f64| Tally { misfit: *misfit, count: 1.0, weight: 0.0, against: 0.0 };
    let mut tallies: Vec<Tally> = misfits.iter().map(alone).collect();
    for edge in edges {
        let tally = &mut tallies[edge.a];
        tally.misfit += misfits[edge.b];
        tally.count += 1.0;
        tally.weight += edge.weight;
        tally.against += edge.agreement(signs).min(0.0).abs();
    }
    tallies
}
