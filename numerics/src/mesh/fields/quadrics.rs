//! The quadrics of the points of a local surface, those of neighbours near each other in memory.

use rayon::prelude::*;

use crate::points::neighbours::Neighbour;
use crate::surface::local::LocalSurface;
use crate::surface::local::smoothed::SampledCloud;

/// A vector of space. Those of the plane have 0 as their third component.
pub type Vector = [f64; 3];

/// The surface around a point: its height over a place δ from the point is `h + ν·δ + ½ δᵀSδ`. Blends read
/// little else from memory, so it fills two cache lines.
#[repr(align(64))]
struct Quadric {
    at: Vector,
    /// ν, of unit length, outward.
    normal: Vector,
    /// h, L.
    height: f64,
    /// S, 1/L: its entries xx, xy, xz, yy, yz, zz.
    shape: [f64; 6],
    /// Spacing at the point, L.
    spacing: f64,
    is_known: bool,
}

/// Bytes of the quadric of a point.
pub const BYTES_PER_POINT: usize = size_of::<Quadric>();

impl Quadric {
    /// `Sδ`.
    fn bend(&self, delta: &Vector) -> Vector {
        let [xx, xy, xz, yy, yz, zz] = self.shape;
        let [x, y, z] = *delta;
        [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z]
    }
}

/// Quadrics of all positions, in the order of the tree of neighbours.
pub struct Quadrics(Vec<Quadric>);

/// Blend of the quadrics around a place.
pub struct Blend {
    /// Height over the surface, outward, L. 0 where no quadric is known.
    pub height: f64,
    /// Gradient of the height without that of the weights.
    pub gradient: Vector,
    /// Length of the mean of the unit normals that the quadrics have at the place, at most 1. On a smooth
    /// surface it is near 1 however much the normals of the points differ. 0 where no quadric is known.
    pub agreement: f64,
    /// Distance from the foot of the place to the mean of the points, L.
    pub off: f64,
    /// Distance to the nearest point, L.
    pub distance: f64,
    /// Spacing at the nearest point, L.
    pub spacing: f64,
}

impl Quadrics {
    /// Lays the quadrics of a surface out. `side` is −1 if its normals point inward.
    pub fn of(surface: &LocalSurface, side: f64) -> Self {
        let tree = surface.ordered().sampling.neighbours();
        let of_position = |position: usize| quadric(surface, tree.points_at(position)[0] as usize, side);
        Self((0..tree.n_positions()).into_par_iter().map(of_position).collect())
    }

    /// Blends the quadrics of some positions at a place.
    #[inline]
    pub fn blend(&self, x: &Vector, near: &[Neighbour]) -> Blend {
        let (mut nearest, mut squared_nearest, mut farthest) = (0, f64::INFINITY, 0.0_f64);
        for neighbour in near {
            let squared = squared_length(&difference(x, &self.0[neighbour.point].at));
            farthest = farthest.max(squared);
            if squared < squared_nearest {
                (nearest, squared_nearest) = (neighbour.point, squared);
            }
        }
        let (mut total, mut height) = (0.0, 0.0);
        let (mut gradient, mut normal, mut mean) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        for quadric in near.iter().map(|near| &self.0[near.point]).filter(|quadric| quadric.is_known) {
            let delta = difference(x, &quadric.at);
            let weight = wendland(squared_length(&delta), farthest);
            let bend = quadric.bend(&delta);
            height += weight * (quadric.height + dot(&quadric.normal, &delta) + 0.5 * dot(&bend, &delta));
            let slope: Vector = std::array::from_fn(|axis| quadric.normal[axis] + bend[axis]);
            // At least 1 long, since shape operators map to the tangent plane.
            let per_length = squared_length(&slope).sqrt().recip();
            for axis in 0..3 {
                gradient[axis] += weight * slope[axis];
                normal[axis] += weight * per_length * slope[axis];
                mean[axis] -= weight * delta[axis];
            }
            total += weight;
        }
        let (distance, spacing) = (squared_nearest.sqrt(), self.0[nearest].spacing);
        if total == 0.0 {
            return Blend { height: 0.0, gradient, agreement: 0.0, off: 0.0, distance, spacing };
        }
        height /= total;
        gradient.iter_mut().chain(&mut normal).chain(&mut mean).for_each(|c| *c /= total);
        let agreement = squared_length(&normal).sqrt();
        let along = height / agreement.max(0.1);
        let off: Vector = std::array::from_fn(|axis| mean[axis] + along * normal[axis]);
        Blend { height, gradient, agreement, off: squared_length(&off).sqrt(), distance, spacing }
    }
}

fn quadric(surface: &LocalSurface, point: usize, side: f64) -> Quadric {
    let SampledCloud { cloud, sampling } = surface.ordered();
    let (d, geometry) = (cloud.dimension(), surface.at_points());
    let shape = &geometry.shapes[point * d * d..][..d * d];
    let entry = |row: usize, column: usize| if column < d { side * shape[row * d + column] } else { 0.0 };
    let normal = padded(&geometry.normals[point * d..][..d]);
    Quadric {
        at: padded(cloud.point(point)),
        normal: normal.map(|c| side * c),
        height: side * geometry.heights[point],
        shape: [entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)],
        spacing: sampling.spacing(point),
        is_known: geometry.is_known[point],
    }
}

/// A vector of 2 or 3 components as one of space.
pub fn padded(x: &[f64]) -> Vector {
    std::array::from_fn(|axis| x.get(axis).copied().unwrap_or(0.0))
}

fn difference(x: &Vector, y: &Vector) -> Vector {
    std::array::from_fn(|axis| x[axis] - y[axis])
}

fn dot(x: &Vector, y: &Vector) -> f64 {
    x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
}

fn squared_length(x: &Vector) -> f64 {
    dot(x, x)
}

/// Wendland's function (1 − r)⁴(4r + 1) of r = distance / farthest, both squared here.
fn wendland(squared: f64, farthest: f64) -> f64 {
    if farthest <= 0.0 {
        return 1.0;
    }
    let r = (squared / farthest).sqrt().min(1.0);
    (1.0 - r).powi(4) * (4.0 * r + 1.0)
}
