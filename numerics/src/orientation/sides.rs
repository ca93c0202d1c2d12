//! Sides by winding numbers: pieces to turn, and points whose sides stay ambiguous.

use super::edges::{Edge, averaged};
use super::parts::Parts;
use super::winding::field::Field;
use super::winding::gauss::Problem;
use super::winding::turns::{TurnedPatches, turn_patches};
use crate::error::NumericsError;

/// Distance of the winding number from ½, averaged over the neighbours on the sheet, beyond which a side is
/// ambiguous.
const DOUBT: f64 = 0.3;

/// Blame for misfits at other points beyond which a side is ambiguous. A wrong sheet from which half of the
/// space is seen has ½.
const BLAME: f64 = 0.25;

/// Bound [`BLAME`] for a piece that was cut into patches. What is left of its wrong sides is small.
const BLAME_OF_CUT: f64 = 0.1;

/// Share of the edges of a point, by weight, that may contradict its side.
const CONTRADICTED: f64 = 0.5;

/// Distance from ½, and the least share of the points of a piece within it for the piece to bound something,
/// with the others. On a flat sheet or half a sphere no point is within it. On a plate with one wrong side
/// half of the points are.
const BOUNDS: f64 = 0.15;
const BOUNDING_SHARE: f64 = 0.2;

/// Distance from ½, and the share of the points of a closed piece that may exceed it.
const CLOSED: f64 = 0.2;
const MAX_OFF: f64 = 0.03;

/// Least number of points of a piece whose sign is estimated. A smaller one contributes less to winding
/// numbers than they are off.
const LEAST_PIECE: usize = 12;

/// Largest median of |w − ½| on a piece that is turned. On a cap of a sphere, which has no inside, it is 0.2.
const ON_PIECE: f64 = 0.12;

/// Sides of the points of a cloud by winding numbers.
pub(super) struct Sides {
    /// True where the evidence for the side of a point is contradictory, `[n]`.
    pub is_ambiguous: Vec<bool>,
    /// True for each piece that is closed, with the others.
    pub is_closed: Vec<bool>,
}

/// Turns pieces, and patches of them, that point to the wrong side. Finds the sides that stay ambiguous.
///
/// # Errors
/// [`NumericsError::Cancelled`].
pub(super) fn settle(
    field: &Field<'_>,
    [sheets, pieces]: [&Parts; 2],
    edges: &[Edge],
    signs: &mut [f64],
) -> Result<Sides, NumericsError> {
    turn_wrong(pieces, field, &[], signs)?;
    if sheets.members.len() > pieces.members.len() {
        turn_wrong(sheets, field, edges, signs)?;
    }
    let TurnedPatches { misfits, is_cut, unclear } = turn_patches(field, pieces, edges, signs)?;
    let near = pieces.shares(&misfits, |misfit| misfit <= BOUNDS);
    let doubt = |(point, misfit): (usize, f64)| {
        let piece = pieces.of_point[point];
        let bounds = near[piece] >= BOUNDING_SHARE || is_cut[piece];
        if bounds && misfit.abs() > DOUBT { misfit } else { 0.0 }
    };
    let doubts: Vec<f64> = averaged(edges, &misfits).into_iter().enumerate().map(doubt).collect();
    let mut is_ambiguous = contradicted(edges, signs);
    for (point, blame) in field.blames(signs, &doubts)?.into_iter().enumerate() {
        let most = if is_cut[pieces.of_point[point]] { BLAME_OF_CUT } else { BLAME };
        is_ambiguous[point] |= doubts[point] != 0.0 || blame > most;
    }
    unclear.into_iter().for_each(|point| is_ambiguous[point] = true);
    let off = pieces.shares(&misfits, |misfit| misfit > CLOSED);
    Ok(Sides { is_ambiguous, is_closed: off.iter().map(|share| *share <= MAX_OFF).collect() })
}

/// Turns large parts that point to the wrong side.
fn turn_wrong(
    parts: &Parts,
    field: &Field<'_>,
    edges: &[Edge],
    signs: &mut [f64],
) -> Result<(), NumericsError> {
    let mut large = parts.by_size();
    large.retain(|&part| parts.members[part].len() >= LEAST_PIECE);
    let problem = Problem::of(field, parts, &large, signs)?.with_springs(parts, edges, signs);
    let turned = problem.turned(ON_PIECE);
    parts.turn(&turned, signs);
    Ok(())
}

/// Returns whether the neighbours of each point contradict its side, `[n]`.
fn contradicted(edges: &[Edge], signs: &[f64]) -> Vec<bool> {
    let (mut weights, mut against) = (vec![0.0; signs.len()], vec![0.0; signs.len()]);
    for edge in edges {
        weights[edge.a()] += edge.weight();
        against[edge.a()] += edge.agreement(signs).min(0.0).abs();
    }
    weights.iter().zip(against).map(|(weight, against)| against > CONTRADICTED * weight).collect()
}
