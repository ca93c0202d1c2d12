//! Joins the regions of all tiles, and chooses their sides.

use super::pieces::{Contradiction, Member, Piece, are_nested};
use super::{Border, Region, TileRegions, total};
use crate::error::NumericsError;
use crate::surface::orientation::consistent::{CONTRADICTION, RESOLVED};
use crate::surface::orientation::forest::SignedForest;
use crate::surface::orientation::parts::Parts;

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
    /// Checks that borders and links lead to regions, and that all regions have one dimension.
    ///
    /// # Errors
    /// [`NumericsError::InvalidTile`], [`NumericsError::InvalidLink`].
    pub fn of(tiles: &'a [TileRegions], links: &'a [[usize; 2]]) -> Result<Self, NumericsError> {
        let n_regions = tiles.iter().map(|tile| tile.regions.len()).sum();
        let all =
            || tiles.iter().enumerate().flat_map(|(at, tile)| tile.regions.iter().map(move |r| (at, r)));
        let d = all().next().map_or(0, |(_, region)| region.centre.len());
        let of_dimension = |region: &Region| {
            [&region.centre, &region.normal, &region.lower, &region.upper].iter().all(|row| row.len() == d)
        };
        if let Some((tile, _)) = all().find(|(_, region)| !of_dimension(region)) {
            let requirement = "has a region whose rows differ in length from those of other regions";
            return Err(NumericsError::InvalidTile { tile, requirement });
        }
        let leads_out = |tile: &TileRegions| {
            tile.borders.iter().flat_map(|border| border.regions).any(|region| region >= tile.regions.len())
        };
        if let Some(tile) = tiles.iter().position(leads_out) {
            return Err(NumericsError::InvalidTile {
                tile,
                requirement: "has a border of a region that is not in its list",
            });
        }
        let leads_nowhere = |link: &[usize; 2]| link.iter().any(|&region| region >= n_regions);
        match links.iter().position(leads_nowhere) {
            Some(link) => Err(NumericsError::InvalidLink { link }),
            None => Ok(Self { tiles, links, n_regions }),
        }
    }

    /// Chooses the sides of all regions, by the rules for a whole cloud.
    pub fn sides(&self) -> Vec<Side> {
        let whole = self.joined();
        let borders = self.borders(&whole.of_point);
        let mut has_sign = vec![false; whole.members.len()];
        for (region, &number) in self.regions().zip(&whole.of_point) {
            has_sign[number] |= region.n_signed > 0;
        }
        let weight: f64 = borders.iter().map(|border| border.agreeing + border.opposing).sum();
        let n_edges: usize = total(self.tiles.iter().map(|tile| tile.n_edges));
        let mut sides = vec![Side { sign: 1.0, is_doubtful: false }; has_sign.len()];
        if weight >= RESOLVED * n_edges as f64 {
            self.choose(&whole.of_point, &borders, &has_sign, &mut sides);
            let against: f64 = borders.iter().map(|border| border.contradiction(&sides)).sum();
            if against > CONTRADICTION * weight {
                let signed = sides.iter_mut().zip(&has_sign).filter(|(_, has_sign)| **has_sign);
                signed.for_each(|(side, _)| side.sign = 1.0);
            }
        }
        whole.of_point.iter().map(|&number| sides[number]).collect()
    }

    fn regions(&self) -> impl Iterator<Item = &'a Region> {
        self.tiles.iter().flat_map(|tile| &tile.regions)
    }

    /// Joins the parts of regions that several tiles have.
    fn joined(&self) -> Parts {
        let mut forest = SignedForest::new(self.n_regions);
        self.links.iter().for_each(|&[a, b]| forest.join(a, b, 1.0));
        Parts::of(&forest.find_all())
    }

    /// Returns the borders of all tiles between whole regions.
    fn borders(&self, numbers: &[usize]) -> Vec<Border> {
        let mut first = 0;
        let mut borders = Vec::new();
        for tile in self.tiles {
            let whole = |border: &Border| {
                let [a, b] = border.regions.map(|region| numbers[first + region]);
                Border { regions: [a.min(b), a.max(b)], ..*border }
            };
            borders.extend(tile.borders.iter().map(whole));
            first += tile.regions.len();
        }
        borders.sort_by_key(|border| border.regions);
        let sum = |same: &[Border]| Border {
            agreeing: same.iter().map(|border| border.agreeing).sum(),
            opposing: same.iter().map(|border| border.opposing).sum(),
            ..same[0]
        };
        borders.chunk_by(|p, q| p.regions == q.regions).map(sum).collect()
    }

    /// Joins whole regions to pieces and chooses the side of each piece.
    fn choose(&self, numbers: &[usize], borders: &[Border], has_sign: &[bool], sides: &mut [Side]) {
        let found = joined_across(borders, has_sign.len()).find_all();
        let parts = Parts::of(&found);
        let mut pieces: Vec<Piece<'_>> = (0..parts.members.len())
            .map(|_| Piece { members: Vec::new(), contradiction: Contradiction::default() })
            .collect();
        for (region, &number) in self.regions().zip(numbers) {
            let (relative, has_sign) = (found[number].sign, has_sign[number]);
            pieces[parts.of_point[number]].members.push(Member { region, relative, has_sign });
        }
        for border in borders.iter().filter(|border| border.regions.iter().all(|&region| has_sign[region])) {
            let of_piece = &mut pieces[parts.of_point[border.regions[0]]].contradiction;
            of_piece.agreeing += border.agreeing;
            of_piece.opposing += border.opposing;
        }
        for ((piece, is_nested), regions) in pieces.iter().zip(are_nested(&pieces)).zip(&parts.members) {
            let (sign, is_doubtful) = piece.side(is_nested);
            let is_several = piece.is_several();
            for &region in regions {
                // Surfaces that nearly touch have the sides that the function says.
                let sign = if is_several && has_sign[region] { 1.0 } else { found[region].sign * sign };
                let is_doubtful = if is_several { !piece.is_resolved() } else { is_doubtful };
                sides[region] = Side { sign, is_doubtful };
            }
        }
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

/// Joins regions by the votes of their borders, surest first.
fn joined_across(borders: &[Border], n_regions: usize) -> SignedForest {
    let mut between: Vec<&Border> = borders
        .iter()
        .filter(|border| border.regions[0] != border.regions[1] && border.vote() != 0.0)
        .collect();
    between.sort_by(|p, q| q.vote().abs().total_cmp(&p.vote().abs()).then(p.regions.cmp(&q.regions)));
    let mut forest = SignedForest::new(n_regions);
    between
        .iter()
        .for_each(|border| forest.join(border.regions[0], border.regions[1], border.vote().signum()));
    forest
}
