//! Surfaces f = 0 of radius about 1, with exact normals and curvatures.

#![allow(dead_code, reason = "every sweep asks for some of it")]

use crate::jet::Jet;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    Sphere,
    Torus,
    Ellipsoid,
    /// Dupin's ring cyclide, its tube three times as thick on one side as on the other.
    Cyclide,
    Superellipsoid,
    /// A level surface of the sum of four Gaussian bells: a rounded tetrapod.
    Blob,
    FatTorus,
    RoundedCube,
    Pebble,
    /// A wave over a square. The surface is open and has a rim.
    Wave,
    /// A sphere with carved detail, deeper and deeper towards one pole: waves of a length of 0.31.
    Carved,
}

pub const SHAPES: [Shape; 6] =
    [Shape::Sphere, Shape::Torus, Shape::Ellipsoid, Shape::Cyclide, Shape::Superellipsoid, Shape::Blob];

/// Shapes that were not used to choose the model and the calibration of its deviations.
pub const HELD_OUT: [Shape; 3] = [Shape::FatTorus, Shape::RoundedCube, Shape::Pebble];

/// Exact normal and curvatures at a point.
#[derive(Debug, Clone, Copy)]
pub struct Truth {
    /// Outward unit normal.
    pub normal: [f64; 3],
    /// Principal curvatures for the outward normal, ascending. A unit sphere has 1 and 1.
    pub curvatures: [f64; 2],
}

impl Shape {
    /// The function f whose zeros are the surface. It grows outward.
    pub fn level(self, x: [f64; 3]) -> Jet {
        let [x, y, z] = Jet::coordinates(x);
        match self {
            Self::Sphere => sum_of_squares(x, y, z) + -1.0,
            Self::Torus => {
                let across = (x.squared() + y.squared()).sqrt() + -0.8;
                across.squared() + z.squared() + -0.04
            }
            Self::Ellipsoid => sum_of_squares(x, 1.0 / 0.7 * y, 2.5 * z) + -1.0,
            Self::FatTorus => {
                let across = (x.squared() + y.squared()).sqrt() + -0.7;
                across.squared() + z.squared() + -0.09
            }
            Self::RoundedCube => {
                let fourth = |x: Jet| x.squared().squared();
                0.6 * (fourth(x) + fourth(y) + fourth(z)) + 0.4 * sum_of_squares(x, y, z) + -1.0
            }
            Self::Pebble => sum_of_squares(x, 1.0 / 0.85 * y, 1.0 / 0.55 * z) + -1.0,
            Self::Wave => z - 0.3 * ((2.0 * x).sin() * (2.0 * y + std::f64::consts::FRAC_PI_2).sin()),
            Self::Carved => {
                let depth = 0.02 * (z + 1.0);
                sum_of_squares(x, y, z) + -1.0 + depth * ((20.0 * x).sin() * (20.0 * y).sin())
            }
            Self::Cyclide => cyclide(1.6 * x, 1.6 * y, 1.6 * z),
            Self::Superellipsoid => {
                let fourth = |x: Jet| x.squared().squared();
                fourth(x) + fourth(1.25 * y) + fourth(1.0 / 0.6 * z) + -0.5
            }
            Self::Blob => {
                let bells =
                    BELLS.map(|[a, b, c]| (-1.0 / 0.12 * sum_of_squares(x + -a, y + -b, z + -c)).exp());
                Jet::constant(0.5) - bells.into_iter().fold(Jet::constant(0.0), |sum, bell| sum + bell)
            }
        }
    }

    /// Half sides of a box about the origin that holds the surface.
    pub fn half_sides(self) -> [f64; 3] {
        match self {
            Self::Sphere => [1.01; 3],
            Self::Torus => [1.01, 1.01, 0.21],
            Self::Ellipsoid => [1.01, 0.71, 0.41],
            Self::Cyclide => [1.1, 1.0, 0.6],
            Self::Superellipsoid => [1.0, 0.8, 0.6],
            Self::Blob => [1.0; 3],
            Self::FatTorus => [1.01, 1.01, 0.31],
            Self::RoundedCube => [1.01; 3],
            Self::Pebble => [1.01, 0.86, 0.56],
            Self::Wave => [1.0, 1.0, 0.31],
            Self::Carved => [1.05; 3],
        }
    }

    /// The point of the surface reached from x along the gradient of f, by Newton's method.
    pub fn project(self, mut x: [f64; 3]) -> [f64; 3] {
        for _ in 0..8 {
            let f = self.level(x);
            let step = f.value / dot(f.gradient, f.gradient);
            (0..3).for_each(|c| x[c] -= step * f.gradient[c]);
        }
        x
    }

    pub fn truth(self, x: [f64; 3]) -> Truth {
        let f = self.level(x);
        let length = dot(f.gradient, f.gradient).sqrt();
        let normal = f.gradient.map(|g| g / length);
        Truth {
            normal,
            curvatures: principal_curvatures(&f.hessian.map(|row| row.map(|h| h / length)), normal),
        }
    }
}

const BELLS: [[f64; 3]; 4] = [[0.45, 0.0, 0.0], [-0.3, 0.35, 0.1], [-0.2, -0.4, -0.1], [0.1, 0.1, 0.45]];

/// Dupin's cyclide: `(|x|² + a² − c² − r²)² = 4(ax − cr)² + 4(a² − c²)y²`.
fn cyclide(x: Jet, y: Jet, z: Jet) -> Jet {
    let (a, c, r): (f64, f64, f64) = (1.0, 0.3, 0.45);
    let b2 = a * a - c * c;
    let left = sum_of_squares(x, y, z) + (b2 - r * r);
    left.squared() - 4.0 * ((a * x + -c * r).squared() + b2 * y.squared())
}

fn sum_of_squares(x: Jet, y: Jet, z: Jet) -> Jet {
    x.squared() + y.squared() + z.squared()
}

/// Eigenvalues, ascending, of a symmetric form on the plane orthogonal to a unit normal.
pub fn principal_curvatures(form: &[[f64; 3]; 3], normal: [f64; 3]) -> [f64; 2] {
    let smallest = (0..3).min_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs())).unwrap();
    let mut along = [0.0; 3];
    along[smallest] = 1.0;
    let part = dot(along, normal);
    (0..3).for_each(|c| along[c] -= part * normal[c]);
    let length = dot(along, along).sqrt();
    let u = along.map(|a| a / length);
    let v = cross(normal, u);
    let of = |u: [f64; 3], v: [f64; 3]| (0..3).map(|i| u[i] * dot(form[i], v)).sum::<f64>();
    let (mean, half, mixed) = (0.5 * (of(u, u) + of(v, v)), 0.5 * (of(u, u) - of(v, v)), of(u, v));
    let apart = half.hypot(mixed);
    [mean - apart, mean + apart]
}

pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
