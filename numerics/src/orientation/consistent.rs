//! Consistent signs for the normals of a cloud.

use super::edges::{Edge, contradiction, join_borders, join_sure_borders, sheet_edges};
use super::forest::SignedForest;
use super::parts::Parts;
use super::pieces::{Bounds, Piece, is_large};
use super::winding::field::Field;
use super::{CloudWithNeighbours, Directions, gaps, n_neighbours, sides};
use crate::error::NumericsError;
use crate::machine::vector::dot;
use crate::observer::for_each;

/// Cosine of neighbouring normals above which they belong to one region.
const SAME_REGION: f64 = 0.7;

/// Least mean weight of pairs of neighbours in a cloud that resolves its surface. Below it normals turn at
/// will from point to point, what seems a flip is the surface, and nothing is repaired. The bunny with 1 % of
/// noise has 0.3, a torus of 24 points 0.06.
pub(super) const RESOLVED: f64 = 0.2;

/// Share of the edges of a piece, by weight, that gradients may contradict for their volume to count. On
/// separate surfaces that nearly touch it is 0.0002 to 0.005. On noisy surfaces whose gradients are wrong it
/// is 0.04 and more, and those enclose more than the truth.
pub(super) const LOCAL_CONTRADICTION: f64 = 0.02;

/// Share of the edges, by weight, that may contradict repaired signs.
pub(super) const CONTRADICTION: f64 = 0.1;

/// Signs to multiply the normals of [`Directions`] with.
#[derive(Debug, PartialEq)]
pub(super) struct Signs {
    pub signs: Vec<f64>,
    /// Number of points whose normal along the gradient pointed the other way.
    pub n_flipped: usize,
    /// True if a connected piece has a rim, so that it has no outside.
    pub is_open: bool,
    /// True if normals of neighbours agree so well as lines that their signs can be compared.
    pub is_resolved: bool,
    /// True where the evidence for the side of a point is contradictory, `[n]`.
    pub is_ambiguous: Vec<bool>,
}

/// Makes the signs of normals consistent. Winding numbers turn nothing where normals are given.
pub(super) fn consistent_signs(
    sampled: &CloudWithNeighbours<'_>,
    directions: &Directions,
    is_given: bool,
) -> Result<Signs, NumericsError> {
    let n = sampled.cloud.n_points();
    let mut edges = sheet_edges(sampled, &directions.normals)?;
    let mut forest = joined(&edges, &directions.has_sign);
    let mut sure = forest.clone();
    join_sure_borders(&mut sure, &edges);
    let sheets = Parts::of(&sure.find_all());
    join_borders(&mut forest, &edges);
    let mut is_at_rim = directions.is_at_rim.clone();
    for edge in gaps::join_across(sampled, &directions.normals, &mut forest)? {
        // The end of a piece at a gap is no end of the surface.
        is_at_rim[edge.a()] = false;
        edges.push(edge);
    }
    // Stable: the edges of a point stay nearest first.
    edges.sort_by_key(|edge| edge.a());
    let found = forest.find_all();
    let pieces = Parts::of(&found);
    let relative: Vec<f64> = found.iter().map(|found| found.sign).collect();
    let scene = Scene { sampled, directions, pieces: &pieces, relative: &relative, is_at_rim: &is_at_rim };
    let (mut signs, mut has_rim) = scene.signs_by_piece(&edges)?;
    let weight: f64 = edges.iter().map(|edge| edge.weight()).sum();
    let is_resolved = weight / (n * n_neighbours(sampled.cloud)) as f64 >= RESOLVED;
    let mut is_ambiguous = vec![false; n];
    if !is_resolved || contradiction(&edges, &signs) > CONTRADICTION {
        (0..n).filter(|&point| directions.has_sign[point]).for_each(|point| signs[point] = 1.0);
    } else if !is_given && let Some(field) = Field::of(sampled, &directions.normals, &edges) {
        let sides = sides::settle(&field, [&sheets, &pieces], &edges, &mut signs)?;
        has_rim.iter_mut().zip(&sides.is_closed).for_each(|(has_rim, is_closed)| *has_rim &= !is_closed);
        is_ambiguous = sides.is_ambiguous;
    }
    let is_end = (0..n).map(|point| is_at_rim[point] && scene.goes_on_smoothly(point)).collect::<Vec<_>>();
    let pieces = pieces.members.iter().map(|points| scene.piece(points));
    has_rim.iter_mut().zip(pieces).for_each(|(has_rim, piece)| *has_rim &= piece.has_rim(&is_end));
    let n_flipped = (0..n).filter(|&point| directions.has_sign[point] && signs[point] < 0.0).count();
    Ok(Signs { signs, n_flipped, is_open: has_rim.contains(&true), is_resolved, is_ambiguous })
}

/// Joins neighbouring points whose signs agree to regions. `has_sign` is `[n]`.
pub(super) fn joined(edges: &[Edge], has_sign: &[bool]) -> SignedForest {
    let mut forest = SignedForest::new(has_sign.len());
    for edge in edges {
        if has_sign[edge.a()] && has_sign[edge.b()] && edge.cosine() > SAME_REGION {
            forest.join(edge.a(), edge.b(), 1.0);
        }
    }
    forest
}

/// A cloud with the pieces of its surface.
struct Scene<'a> {
    sampled: &'a CloudWithNeighbours<'a>,
    directions: &'a Directions,
    pieces: &'a Parts,
    /// The sign of each point relative to its piece, `[n]`.
    relative: &'a [f64],
    is_at_rim: &'a [bool],
}

impl Scene<'_> {
    fn piece<'a>(&'a self, points: &'a [usize]) -> Piece<'a> {
        let Self { sampled, directions, relative, .. } = self;
        Piece { sampled, directions, points, relative }
    }

    /// Returns whether the normals around a point are like its own. At a sharp edge each sheet has a rim, and
    /// the surface goes on with another normal.
    fn goes_on_smoothly(&self, point: usize) -> bool {
        let d = self.sampled.cloud.dimension();
        let normal = |point: usize| &self.directions.normals[point * d..][..d];
        let around = self.sampled.around.around(point).iter();
        around.map(|&other| dot(normal(point), normal(other as usize))).all(|along| along.abs() > SAME_REGION)
    }

    /// Chooses the signs of points, for each piece by itself. Also returns whether each piece has a rim.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    fn signs_by_piece(&self, edges: &[Edge]) -> Result<(Vec<f64>, Vec<bool>), NumericsError> {
        let has_sign = &self.directions.has_sign;
        let raw = self.contradictions(edges);
        let boxes = self.boxes_of_large();
        let (mut signs, mut has_rims) =
            (self.relative.to_vec(), Vec::with_capacity(self.pieces.members.len()));
        for_each(self.pieces.members.iter().enumerate(), self.sampled.observer, |(at, points)| {
            let (sampled, piece) = (self.sampled, self.piece(points));
            let has_rim = piece.has_rim(self.is_at_rim);
            let own = Bounds::of(sampled.cloud, points);
            let is_nested = boxes.iter().any(|(other, bounds)| *other != at && bounds.contain(&own));
            let sign = piece.sign(has_rim, is_nested);
            points.iter().for_each(|&point| signs[point] *= sign);
            if !has_rim && raw[at] < LOCAL_CONTRADICTION && piece.loses_volume() {
                points.iter().filter(|&&point| has_sign[point]).for_each(|&point| signs[point] = 1.0);
            }
            has_rims.push(has_rim);
        })?;
        Ok((signs, has_rims))
    }

    /// Returns boxes around the large pieces, [`MAX_LARGE`] at most.
    ///
    /// [`MAX_LARGE`]: super::pieces::MAX_LARGE
    fn boxes_of_large(&self) -> Vec<(usize, Bounds)> {
        let (cloud, members) = (self.sampled.cloud, &self.pieces.members);
        let large = (0..members.len()).filter(|&piece| is_large(members[piece].len(), cloud.n_points()));
        large.map(|piece| (piece, Bounds::of(cloud, &members[piece]))).collect()
    }

    /// Returns the [`contradiction`] of the gradients by themselves, in each piece. It is 0 where there are
    /// none.
    fn contradictions(&self, edges: &[Edge]) -> Vec<f64> {
        let has_sign = &self.directions.has_sign;
        let mut opposite = vec![0.0; self.pieces.members.len()];
        let mut total = opposite.clone();
        for edge in edges.iter().filter(|edge| has_sign[edge.a()] && has_sign[edge.b()]) {
            let piece = self.pieces.of_point[edge.a()];
            total[piece] += edge.weight();
            opposite[piece] += if edge.cosine() < 0.0 { edge.weight() } else { 0.0 };
        }
        let share = |(opposite, total): (f64, f64)| if total > 0.0 { opposite / total } else { 0.0 };
        opposite.into_iter().zip(total).map(share).collect()
    }
}
