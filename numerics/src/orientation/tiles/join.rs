//! Joins the regions of all tiles, and chooses their sides.

use super::pieces::{Contradiction, Member, Piece, are_nested};
use super::{Border, Region, TileRegions};
use crate::error::NumericsError;
use crate::observer::{Observer, for_each, sort_by};
use crate::orientation::consistent::{CONTRADICTION, RESOLVED};
use crate::orientation::forest::{Membership, SignedForest};
use crate::orientation::n_neighbours_in;
use crate::orientation::parts::Parts;

/// The side of a region.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    /// Sign to multiply the normals of the region with, 1 or −1.
    pub sign: f64,
    /// True if the side is nearly a matter of chance.
    pub is_doubtful: bool,
}

/// Regions of all tiles, those of one tile after those of another, with links between parts of one region.
pub struct Tiling<'a> {
    tiles: &'a [TileRegions],
    links: &'a [[usize; 2]],
    n_regions: usize,
}

impl<'a> Tiling<'a> {
    /// Checks that borders and links lead to regions, that all regions have one dimension, and that counts
    /// can be those of a cloud.
    ///
    /// # Errors
    /// [`NumericsError::InvalidTile`], [`NumericsError::InvalidRegion`], [`NumericsError::InvalidLink`],
    /// [`NumericsError::Cancelled`].
    pub fn of(
        tiles: &'a [TileRegions],
        links: &'a [[usize; 2]],
        observer: &dyn Observer,
    ) -> Result<Self, NumericsError> {
        let first = tiles.iter().find_map(|tile| tile.regions.first());
        let mut counted =
            RegionCounter { dimension: first.map_or(0, |region| region.centre.len()), n_points: 0 };
        for (at, tile) in tiles.iter().enumerate() {
            observer.checkpoint()?;
            counted.add(at, tile, observer)?;
        }
        let n_regions = tiles.iter().map(|tile| tile.regions.len()).sum();
        let leads_nowhere = |link: &[usize; 2]| link.iter().any(|&region| region >= n_regions);
        match links.iter().position(leads_nowhere) {
            Some(link) => Err(NumericsError::InvalidLink { link }),
            None => Ok(Self { tiles, links, n_regions }),
        }
    }

    /// Chooses the sides of all regions, by the rules for a whole cloud.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub fn sides(&self, observer: &dyn Observer) -> Result<Vec<Side>, NumericsError> {
        let whole = self.joined(observer)?;
        let borders = self.borders(&whole.of_point, observer)?;
        let mut has_sign = vec![false; whole.members.len()];
        for (region, &number) in self.regions().zip(&whole.of_point) {
            has_sign[number] |= region.n_signed > 0;
        }
        let weight: f64 = borders.iter().map(|border| border.agreeing + border.opposing).sum();
        let n_edges: f64 = self.tiles.iter().map(|tile| tile.n_edges as f64).sum();
        let mut sides = vec![Side { sign: 1.0, is_doubtful: false }; has_sign.len()];
        if weight >= RESOLVED * n_edges {
            let joined = WholeRegions { numbers: &whole.of_point, borders: &borders, has_sign: &has_sign };
            self.choose(&joined, &mut sides, observer)?;
            let against: f64 = borders.iter().map(|border| border.contradiction(&sides)).sum();
            if against > CONTRADICTION * weight {
                let signed = sides.iter_mut().zip(&has_sign).filter(|(_, has_sign)| **has_sign);
                signed.for_each(|(side, _)| side.sign = 1.0);
            }
        }
        Ok(whole.of_point.iter().map(|&number| sides[number]).collect())
    }

    fn regions(&self) -> impl Iterator<Item = &'a Region> {
        self.tiles.iter().flat_map(|tile| &tile.regions)
    }

    /// Joins the parts of regions that several tiles have.
    fn joined(&self, observer: &dyn Observer) -> Result<Parts, NumericsError> {
        let mut forest = SignedForest::new(self.n_regions);
        for_each(self.links, observer, |&[a, b]| forest.join(a, b, 1.0))?;
        Ok(Parts::of(&forest.find_all()))
    }

    /// Returns the borders of all tiles between whole regions.
    fn borders(&self, numbers: &[usize], observer: &dyn Observer) -> Result<Vec<Border>, NumericsError> {
        let mut first = 0;
        let mut borders = Vec::new();
        for tile in self.tiles {
            observer.checkpoint()?;
            let whole = |border: &Border| {
                let [a, b] = border.regions.map(|region| numbers[first + region]);
                Border { regions: [a.min(b), a.max(b)], ..*border }
            };
            borders.extend(tile.borders.iter().map(whole));
            first += tile.regions.len();
        }
        sort_by(&mut borders, observer, |p, q| p.regions.cmp(&q.regions))?;
        let sum = |same: &[Border]| Border {
            agreeing: same.iter().map(|border| border.agreeing).sum(),
            opposing: same.iter().map(|border| border.opposing).sum(),
            ..same[0]
        };
        Ok(borders.chunk_by(|p, q| p.regions == q.regions).map(sum).collect())
    }

    /// Joins whole regions to pieces and chooses the side of each piece.
    fn choose(
        &self,
        joined: &WholeRegions<'_>,
        sides: &mut [Side],
        observer: &dyn Observer,
    ) -> Result<(), NumericsError> {
        let has_sign = joined.has_sign;
        let found = joined.across_borders(observer)?.find_all();
        let parts = Parts::of(&found);
        let pieces = self.pieces(joined, &found, &parts, observer)?;
        let are_nested = are_nested(&pieces, observer)?;
        for ((piece, is_nested), regions) in pieces.iter().zip(are_nested).zip(&parts.members) {
            observer.checkpoint()?;
            let (sign, is_doubtful) = piece.side(is_nested);
            let is_several = piece.is_several();
            for &region in regions {
                // Surfaces that nearly touch have the sides that the function says.
                let sign = if is_several && has_sign[region] { 1.0 } else { found[region].sign * sign };
                let is_doubtful = if is_several { !piece.is_resolved() } else { is_doubtful };
                sides[region] = Side { sign, is_doubtful };
            }
        }
        Ok(())
    }

    /// Gathers the regions of each piece, and what its borders say.
    fn pieces(
        &self,
        joined: &WholeRegions<'_>,
        found: &[Membership],
        parts: &Parts,
        observer: &dyn Observer,
    ) -> Result<Vec<Piece<'a>>, NumericsError> {
        let WholeRegions { numbers, borders, has_sign } = *joined;
        let mut pieces: Vec<Piece<'a>> = (0..parts.members.len())
            .map(|_| Piece { members: Vec::new(), contradiction: Contradiction::default() })
            .collect();
        for_each(self.regions().zip(numbers), observer, |(region, &number)| {
            let (relative, has_sign) = (found[number].sign, has_sign[number]);
            pieces[parts.of_point[number]].members.push(Member { region, relative, has_sign });
        })?;
        for border in borders.iter().filter(|border| border.regions.iter().all(|&region| has_sign[region])) {
            let of_piece = &mut pieces[parts.of_point[border.regions[0]]].contradiction;
            of_piece.agreeing += border.agreeing;
            of_piece.opposing += border.opposing;
        }
        Ok(pieces)
    }
}

/// Most points of all regions. Beyond it, counts are not exact as floats.
const MAX_POINTS: usize = 1 << 53;

/// Sums over the regions that were checked.
struct RegionCounter {
    dimension: usize,
    n_points: usize,
}

impl RegionCounter {
    /// Checks a tile and adds its regions.
    fn add(&mut self, at: usize, tile: &TileRegions, observer: &dyn Observer) -> Result<(), NumericsError> {
        let before = self.n_points;
        let mut refused = None;
        for_each(tile.regions.iter().enumerate(), observer, |(region, found)| {
            refused = refused.or_else(|| self.refusal(found).map(|requirement| (region, requirement)));
        })?;
        if let Some((region, requirement)) = refused {
            return Err(NumericsError::InvalidRegion { tile: at, region, requirement });
        }
        let invalid = |requirement| Err(NumericsError::InvalidTile { tile: at, requirement });
        if tile.n_edges > (self.n_points - before).saturating_mul(n_neighbours_in(self.dimension)) {
            return invalid("counts more edges than its points can have");
        }
        let leads_out = |border: &Border| border.regions.iter().any(|&region| region >= tile.regions.len());
        if tile.borders.iter().any(leads_out) {
            return invalid("has a border of a region that is not in its list");
        }
        Ok(())
    }

    /// Adds a region, or says why there is no such region.
    fn refusal(&mut self, region: &Region) -> Option<&'static str> {
        let Region { n_points, n_signed, n_coarse, .. } = *region;
        let rows = [&region.centre, &region.normal, &region.lower, &region.upper];
        if rows.iter().any(|row| row.len() != self.dimension) {
            return Some("has rows that differ in length from those of other regions");
        }
        if n_signed > n_points || n_coarse > n_points {
            return Some("counts more points with a sign, or of the coarse cloud, than points");
        }
        self.n_points = self.n_points.saturating_add(n_points);
        (self.n_points > MAX_POINTS).then_some("brings the points of all regions beyond 2^53")
    }
}

/// Whole regions with what is known of them.
struct WholeRegions<'a> {
    /// The whole region of each region.
    numbers: &'a [usize],
    borders: &'a [Border],
    has_sign: &'a [bool],
}

impl WholeRegions<'_> {
    /// Joins regions by the votes of their borders, surest first.
    fn across_borders(&self, observer: &dyn Observer) -> Result<SignedForest, NumericsError> {
        let is_between = |border: &&Border| border.regions[0] != border.regions[1] && border.vote() != 0.0;
        let mut between: Vec<&Border> = self.borders.iter().filter(is_between).collect();
        sort_by(&mut between, observer, |p, q| {
            q.vote().abs().total_cmp(&p.vote().abs()).then(p.regions.cmp(&q.regions))
        })?;
        let mut forest = SignedForest::new(self.has_sign.len());
        for_each(between, observer, |border| {
            forest.join(border.regions[0], border.regions[1], border.vote().signum());
        })?;
        Ok(forest)
    }
}

impl Border {
    fn vote(&self) -> f64 {
        self.agreeing - self.opposing
    }

    /// Weight of the edges across which normals with these sides are opposite.
    fn contradiction(&self, sides: &[Side]) -> f64 {
        let [a, b] = self.regions.map(|region| sides[region].sign);
        if a * b > 0.0 { self.opposing } else { self.agreeing }
    }
}
