//! Sharp edges and steps: places where two sheets of a surface meet at an angle, or end beside each other at
//! two heights.
//!
//! The quadric of each neighbour is extrapolated to the query: to the height of the query above it, and to
//! its normal there. On a smooth surface all extrapolations agree. Around an edge they form two groups, which
//! the deviation of a regression over one group, or over both, does not show. A query is at an edge unless it
//! lies on one sheet alone and its own normal is that of this sheet.

use rayon::prelude::*;
use smallvec::SmallVec;

use super::smoothed::SampledCloud;
use crate::error::NumericsError;
use crate::machine::vector::{dot, norm};
use crate::observer::Observer;
use crate::patches::{MAX_LOCAL_DIMENSION, PatchGeometry};
use crate::points::cloud::Cloud;
use crate::points::neighbours::Neighbour;
use crate::surface::served::Edge;

/// Number of neighbours in dimensions 2, 3 and 4: those within two to three spacings.
const N_ASKED: [usize; 3] = [6, 20, 33];

/// Greatest angle, radians, by which the quadric of a neighbour turns from it to the query. Beyond, quadrics
/// extrapolate too badly, and every circle of ten points would have edges.
const MOST_TURN: f64 = 0.6;

/// Least and greatest angle between the sheets of an edge, radians. Less is a bend. With more, the two faces
/// of a thin wall of which one has the wrong sign would be an edge.
const LEAST_ANGLE: f64 = 0.52;
const GREATEST_ANGLE: f64 = 2.97;

/// Least height of a step, in spacings.
const LEAST_STEP: f64 = 0.5;

/// Standard deviations by which the normals of two sheets differ, or their heights. With noise of a spacing,
/// half a per cent of the points of a torus are then taken for edges. Without this bound, a fifth is.
const APART: f64 = 1.5;

/// Angle within which normals belong to one sheet, radians, and difference of heights, in spacings. As much
/// again is allowed for their deviations.
const SAME_SHEET: f64 = 0.2;
const SAME_HEIGHT: f64 = 0.25;

/// Standard deviations within which a query is on a sheet, and its normal that of a sheet.
const DEVIATIONS: f64 = 3.0;

/// Greatest height above both sheets, in spacings, of a query that is at their edge, and greatest standard
/// deviation of it. On scans, which have creases everywhere, heights that are known less take twice as many
/// points for edges.
const NEAR: f64 = 1.5;
const KNOWN: f64 = 1.0;

/// Rounding of heights, in spacings, and of normals, radians.
const ROUNDING: f64 = 1e-6;

/// Standard deviation of a normal distribution over the median of its magnitudes.
const OF_MEDIAN: f64 = 1.5;

/// Queries with the geometry that regressions give them.
pub(super) struct Queries<'a> {
    pub places: &'a Cloud,
    pub geometry: &'a PatchGeometry,
    /// Noise across the surface of each query that is a point, L, and 0 of exact places, `[m]`.
    pub noise: &'a (dyn Fn(usize) -> f64 + Sync),
}

/// The points of a surface with their geometry, normals outward.
pub(super) struct Points<'a> {
    pub on: SampledCloud<'a>,
    pub geometry: &'a PatchGeometry,
}

type Vector = SmallVec<[f64; MAX_LOCAL_DIMENSION]>;

/// The sheet of a neighbour, extrapolated to a query.
struct Extrapolation {
    normal: Vector,
    /// Height of the query above the sheet, spacings.
    height: f64,
    /// Standard deviations of the angle of the normal, and of the height.
    normal_deviation: f64,
    height_deviation: f64,
}

/// A sheet by all neighbours that agree on it.
struct Sheet {
    mean: Extrapolation,
    /// How far they differ: what a quadric extrapolates badly.
    normal_spread: f64,
    height_spread: f64,
}

impl Points<'_> {
    /// Finds the queries that are at edges, ascending.
    ///
    /// # Errors
    /// [`NumericsError::Cancelled`].
    pub(super) fn edges_at(
        &self,
        queries: &Queries<'_>,
        observer: &dyn Observer,
    ) -> Result<Vec<Edge>, NumericsError> {
        let known =
            (0..queries.places.n_points()).into_par_iter().filter(|&at| queries.geometry.is_known[at]);
        let edge = |found: &mut Vec<Neighbour>, query: usize| {
            observer.checkpoint()?;
            Ok(self.normals_at(query, queries, found).map(|normals| Edge { query, normals }))
        };
        known.map_init(Vec::new, edge).filter_map(Result::transpose).collect()
    }

    /// Returns the normals of both sheets at a query, `[2, d]`, if it is at an edge. `found` is a buffer.
    fn normals_at(
        &self,
        query: usize,
        queries: &Queries<'_>,
        found: &mut Vec<Neighbour>,
    ) -> Option<Vec<f64>> {
        let (x, d) = (queries.places.point(query), queries.places.dimension());
        let n_asked = N_ASKED[d.clamp(2, MAX_LOCAL_DIMENSION) - 2];
        self.on.sampling.neighbours().nearest_into(x, n_asked, found);
        let spacing = self.on.sampling.spacing(found.first()?.point);
        let known = found.iter().filter(|neighbour| self.geometry.is_known[neighbour.point]);
        let sheets: SmallVec<[Extrapolation; 32]> =
            known.filter_map(|neighbour| self.extrapolation(x, neighbour, spacing)).collect();
        if sheets.iter().all(|other| sheets[0].is_as(other)) {
            return None;
        }
        // The sheet by the regression of the query itself, at height 0 with the noise of the query.
        let own = Extrapolation {
            normal: queries.geometry.normals[query * d..][..d].into(),
            height: 0.0,
            normal_deviation: queries.geometry.normal_std[query],
            height_deviation: (queries.noise)(query) / spacing,
        };
        let first = Sheet::of(&sheets, d, |other| own.agrees(other));
        let first = first.or_else(|| Sheet::of(&sheets, d, |_| true))?;
        let second = Sheet::of(&sheets, d, |other| first.mean.is_apart_from(other, 0.0))?;
        let are_two = first.mean.is_apart_from(&second.mean, APART) && first.is_near() && second.is_near();
        let is_clear = own.is_of(&first) && !own.is_on(&second);
        (are_two && !is_clear).then(|| [first.mean.normal, second.mean.normal].concat())
    }

    /// Extrapolates the sheet of a neighbour to x, where points have this spacing. `None` where it would turn
    /// too far on the way.
    fn extrapolation(&self, x: &[f64], neighbour: &Neighbour, spacing: f64) -> Option<Extrapolation> {
        let (of, d, point) = (self.geometry, x.len(), neighbour.point);
        let (normal, shape) = (&of.normals[point * d..][..d], &of.shapes[point * d * d..][..d * d]);
        let arm: Vector = x.iter().zip(self.on.cloud.point(point)).map(|(x, y)| x - y).collect();
        let turn: Vector = shape.chunks_exact(d).map(|row| dot(row, &arm)).collect();
        if norm(&turn) > MOST_TURN {
            return None;
        }
        let height = of.heights[point] + dot(normal, &arm) + 0.5 * dot(&turn, &arm);
        let normal_deviation = of.normal_std[point];
        let height_deviation = of.height_std[point].hypot(normal_deviation * norm(&arm));
        let normal = unit(normal.iter().zip(&turn).map(|(n, t)| n + t).collect());
        Some(Extrapolation {
            normal,
            height: height / spacing,
            normal_deviation,
            height_deviation: height_deviation / spacing,
        })
    }
}

impl Extrapolation {
    /// Whether both describe one smooth sheet, whatever their deviations.
    fn is_as(&self, other: &Self) -> bool {
        angle(&self.normal, &other.normal) <= SAME_SHEET && (self.height - other.height).abs() <= SAME_HEIGHT
    }

    fn agrees(&self, other: &Self) -> bool {
        let [of_normals, of_heights] = self.doubts(other).map(|doubt| DEVIATIONS * doubt);
        angle(&self.normal, &other.normal) <= SAME_SHEET + of_normals.min(SAME_SHEET)
            && (self.height - other.height).abs() <= SAME_HEIGHT + of_heights.min(SAME_HEIGHT)
    }

    /// Whether these are two sheets that meet at an angle or a step, by so many standard deviations.
    fn is_apart_from(&self, other: &Self, deviations: f64) -> bool {
        let [of_normals, of_heights] = self.doubts(other).map(|doubt| deviations * doubt);
        let between = angle(&self.normal, &other.normal);
        let step = (self.height - other.height).abs();
        (LEAST_ANGLE.max(of_normals)..GREATEST_ANGLE).contains(&between)
            || between < LEAST_ANGLE && step >= LEAST_STEP.max(of_heights)
    }

    /// Standard deviations of the angle between two normals, and of the difference of two heights.
    fn doubts(&self, other: &Self) -> [f64; 2] {
        [
            self.normal_deviation.hypot(other.normal_deviation),
            self.height_deviation.hypot(other.height_deviation),
        ]
    }
}

impl Sheet {
    /// Returns the sheet on which most neighbours agree with one that is a `candidate`, if there are as many
    /// as dimensions.
    fn of(
        all: &[Extrapolation],
        dimension: usize,
        is_candidate: impl Fn(&Extrapolation) -> bool,
    ) -> Option<Self> {
        let n_agreed = |of: &&Extrapolation| all.iter().filter(|other| of.agrees(other)).count();
        let best = all.iter().filter(|of| is_candidate(of)).max_by_key(n_agreed)?;
        let members: SmallVec<[&Extrapolation; 32]> = all.iter().filter(|other| best.agrees(other)).collect();
        if members.len() < dimension {
            return None;
        }
        let mut sum = Vector::from_elem(0.0, dimension);
        for member in &members {
            sum.iter_mut().zip(&member.normal).for_each(|(sum, c)| *sum += c);
        }
        let normal = unit(sum);
        let height = median(&members, |member| member.height);
        Some(Self {
            normal_spread: OF_MEDIAN * median(&members, |member| angle(&member.normal, &normal)),
            height_spread: OF_MEDIAN * median(&members, |member| (member.height - height).abs()),
            mean: Extrapolation {
                height,
                normal_deviation: median(&members, |member| member.normal_deviation),
                height_deviation: median(&members, |member| member.height_deviation),
                normal,
            },
        })
    }

    fn height_deviation(&self) -> f64 {
        self.mean.height_deviation.hypot(self.height_spread)
    }

    fn is_near(&self) -> bool {
        let deviation = self.height_deviation();
        deviation <= KNOWN && self.mean.height.abs() <= NEAR + DEVIATIONS * deviation
    }
}

impl Extrapolation {
    fn is_on(&self, sheet: &Sheet) -> bool {
        let deviation = sheet.height_deviation().hypot(self.height_deviation);
        sheet.mean.height.abs() <= DEVIATIONS * deviation + ROUNDING
    }

    /// Whether the query is on the sheet and has its normal.
    fn is_of(&self, sheet: &Sheet) -> bool {
        let [deviation, _] = self.doubts(&sheet.mean);
        let between = angle(&self.normal, &sheet.mean.normal);
        self.is_on(sheet) && between <= DEVIATIONS * deviation.hypot(sheet.normal_spread) + SAME_SHEET
    }
}

fn median(members: &[&Extrapolation], of: impl Fn(&Extrapolation) -> f64) -> f64 {
    let mut all: SmallVec<[f64; 32]> = members.iter().map(|member| of(member)).collect();
    all.sort_unstable_by(f64::total_cmp);
    all[all.len() / 2]
}

fn unit(mut vector: Vector) -> Vector {
    let length = norm(&vector);
    vector.iter_mut().for_each(|c| *c /= length);
    vector
}

/// Returns the angle between unit vectors, radians, accurate where it is small.
fn angle(a: &[f64], b: &[f64]) -> f64 {
    let apart = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    2.0 * (0.5 * apart).min(1.0).asin()
}
