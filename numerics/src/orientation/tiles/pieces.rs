//! Connected pieces of the regions of all tiles, and the side of each.

use super::Region;
use crate::error::NumericsError;
use crate::observer::{Observer, for_each};
use crate::orientation::consistent::LOCAL_CONTRADICTION;
use crate::orientation::pieces::{Bounds, Evidence, are_several, is_large};
use crate::patches::n_regressed;

/// Points of the coarse cloud from which on its function is taken to know a piece. Of spheres with 3 it turns
/// a third inside out, of spheres with 10 none.
const RESOLVED_BY: usize = 10;

/// Weights of edges between regions that have a sign, by how their normals agree.
#[derive(Clone, Copy, Default)]
pub(super) struct Contradiction {
    pub agreeing: f64,
    pub opposing: f64,
}

/// A region of a tile as a part of a piece.
pub(super) struct Member<'a> {
    pub region: &'a Region,
    /// Sign relative to the other regions of the piece.
    pub relative: f64,
    /// True if the signature function determines the side of the region in any tile.
    pub has_sign: bool,
}

/// A piece: the regions of it in every tile.
pub(super) struct Piece<'a> {
    pub members: Vec<Member<'a>>,
    pub contradiction: Contradiction,
}

impl Piece<'_> {
    /// Returns the sign of the piece, and whether it is doubtful: nearly a matter of chance.
    pub(super) fn side(&self, is_nested: bool) -> (f64, bool) {
        let dimension = self.centre().len();
        let signed = || self.members.iter().filter(|member| member.has_sign);
        let evidence = Evidence {
            total: signed().map(|member| member.region.area).sum(),
            vote: signed().map(|member| member.relative * member.region.area).sum(),
            volume: self.volume(|member| member.relative),
            ball: self.ball(),
            is_nested,
        };
        let is_known =
            evidence.is_bulky() || evidence.total > 0.0 && evidence.is_unanimous() && self.is_resolved();
        // A piece with no more points than one regression sees lies on another one, which the function knows.
        (evidence.sign(false), !is_known && self.n_points() > n_regressed(dimension))
    }

    /// Returns whether the coarse cloud has so much of the piece that its function knows the side.
    pub(super) fn is_resolved(&self) -> bool {
        self.regions().map(|region| region.n_coarse).sum::<usize>() >= RESOLVED_BY
    }

    /// Returns whether the piece is several surfaces that nearly touch. The function contradicts itself
    /// across few of its edges, and encloses more by itself than with signs that go together.
    pub(super) fn is_several(&self) -> bool {
        let Contradiction { agreeing, opposing } = self.contradiction;
        let if_signed = |member: &Member<'_>, sign: f64| if member.has_sign { sign } else { 0.0 };
        let alone = self.volume(|member| if_signed(member, 1.0)).abs();
        let together = self.volume(|member| if_signed(member, member.relative)).abs();
        opposing <= LOCAL_CONTRADICTION * (agreeing + opposing)
            && are_several([alone, together], self.centre().len())
    }

    pub(super) fn n_points(&self) -> usize {
        self.regions().map(|region| region.n_points).sum()
    }

    pub(super) fn bounds(&self) -> Bounds {
        let corners = self.members.iter().map(|member| (&member.region.lower, &member.region.upper));
        corners.fold(Bounds::default(), |bounds, (lower, upper)| bounds.with(lower, upper))
    }

    fn centre(&self) -> Vec<f64> {
        let area: f64 = self.regions().map(|region| region.area).sum();
        let mut centre =
            self.regions().next().map(|region| vec![0.0; region.centre.len()]).unwrap_or_default();
        for region in self.regions() {
            let share = if area > 0.0 { region.area / area } else { 0.0 };
            centre.iter_mut().zip(&region.centre).for_each(|(c, x)| *c += share * x);
        }
        centre
    }

    /// `Σ a (x − c)·ν` about the centre of the piece, with these signs of its regions.
    fn volume(&self, sign: impl Fn(&Member<'_>) -> f64) -> f64 {
        let centre = self.centre();
        let of_region = |region: &Region| {
            let arm = region.centre.iter().zip(&centre).map(|(x, c)| x - c);
            region.volume + arm.zip(&region.normal).map(|(a, n)| a * n).sum::<f64>()
        };
        self.members.iter().map(|member| sign(member) * of_region(member.region)).sum()
    }

    /// `Σ a |x − c|`, or a little more: |x − c| is averaged by its square within each region.
    fn ball(&self) -> f64 {
        let centre = self.centre();
        let of_region = |region: &Region| {
            let squared = region.centre.iter().zip(&centre).map(|(x, c)| (x - c).powi(2)).sum::<f64>();
            (region.area * (region.spread + region.area * squared)).sqrt()
        };
        self.regions().map(of_region).sum()
    }

    fn regions(&self) -> impl Iterator<Item = &Region> {
        self.members.iter().map(|member| member.region)
    }
}

/// Returns which pieces lie in the box of another one, a large one. There are [`MAX_LARGE`] of these at most.
///
/// [`MAX_LARGE`]: crate::orientation::pieces::MAX_LARGE
pub(super) fn are_nested(pieces: &[Piece<'_>], observer: &dyn Observer) -> Result<Vec<bool>, NumericsError> {
    let mut sums = Vec::with_capacity(pieces.len());
    for_each(pieces, observer, |piece| sums.push((piece.n_points(), piece.bounds())))?;
    let large = large(sums.iter().map(|(n_points, _)| *n_points));
    let is_in = |piece: usize, other: usize| other != piece && sums[other].1.contain(&sums[piece].1);
    let mut are_nested = Vec::with_capacity(pieces.len());
    for_each(0..pieces.len(), observer, |piece| {
        are_nested.push(large.iter().any(|&other| is_in(piece, other)));
    })?;
    Ok(are_nested)
}

/// Returns the positions of the large ones among pieces with so many points.
fn large(n_points: impl Iterator<Item = usize> + Clone) -> Vec<usize> {
    let n_of_all = n_points.clone().sum();
    let is_such = |(piece, n_points): (usize, usize)| is_large(n_points, n_of_all).then_some(piece);
    n_points.enumerate().filter_map(is_such).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::orientation::pieces::MAX_LARGE;

    #[test]
    fn no_more_than_a_hundred_pieces_are_large_whatever_their_points() {
        let of = |counts: &[usize]| large(counts.iter().copied()).len();
        assert_eq!(of(&[0; 1000]), 0);
        assert_eq!(of(&[1; 1000]), 0);
        assert_eq!(of(&[7; MAX_LARGE]), MAX_LARGE);
        assert_eq!(of(&[[1; MAX_LARGE].as_slice(), &[0; 1000]].concat()), MAX_LARGE);
        assert_eq!(of(&[0, 99, 1, 0]), 2);
    }
}
