//! Surfaces with known normals and curvatures, sampled regularly and at random.

use std::f64::consts::PI;

use gramian_numerics::points::cloud::Cloud;

use super::common::clouds::{fibonacci_sphere, random_cube, random_sphere, rows, square_grid, stretched};
use super::common::random::Random;

/// A surface given by its implicit function, positive outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    Sphere,
    /// R₁ = 1, R₂ = 0.4.
    Torus,
    /// Half axes 1, 0.7, 0.5.
    Ellipsoid,
    /// `z = (x² − y²)/2` over [−1, 1]².
    Saddle,
    /// `z = 0` over [−1, 1]².
    Plane,
}

pub const SHAPES: [Shape; 5] = [Shape::Sphere, Shape::Torus, Shape::Ellipsoid, Shape::Saddle, Shape::Plane];

const AXES: [f64; 3] = [1.0, 0.7, 0.5];
const TUBE: f64 = 0.4;

impl Shape {
    /// n points at random, or regular: Fibonacci lattices, and grids of the largest square number up to n.
    pub fn sample(self, n: usize, random: Option<&mut Random>) -> Vec<[f64; 3]> {
        match self {
            Self::Sphere => rows(&sphere(n, random)),
            Self::Ellipsoid => rows(&stretched(&sphere(n, random), &AXES)),
            Self::Torus => torus(n, random),
            Self::Saddle | Self::Plane => square(n, random).points().map(|x| self.over(x[0], x[1])).collect(),
        }
    }

    fn over(self, x: f64, y: f64) -> [f64; 3] {
        [x, y, if self == Self::Saddle { 0.5 * (x * x - y * y) } else { 0.0 }]
    }

    /// Gradient and Hessian of the implicit function at a point of the surface.
    fn differential(self, [x, y, z]: [f64; 3]) -> ([f64; 3], [[f64; 3]; 3]) {
        let diagonal = |a: f64, b: f64, c: f64| [[a, 0.0, 0.0], [0.0, b, 0.0], [0.0, 0.0, c]];
        match self {
            Self::Sphere => ([2.0 * x, 2.0 * y, 2.0 * z], diagonal(2.0, 2.0, 2.0)),
            Self::Ellipsoid => {
                let w = AXES.map(|a| 2.0 / (a * a));
                ([w[0] * x, w[1] * y, w[2] * z], diagonal(w[0], w[1], w[2]))
            }
            Self::Saddle => ([-x, y, 1.0], diagonal(-1.0, 1.0, 0.0)),
            Self::Plane => ([0.0, 0.0, 1.0], diagonal(0.0, 0.0, 0.0)),
            Self::Torus => {
                // (ρ − 1)² + z², with ρ² = x² + y².
                let rho = x.hypot(y);
                let slope = 2.0 * (1.0 - 1.0 / rho);
                let bend = 2.0 / rho.powi(3);
                let h = [
                    [slope + bend * x * x, bend * x * y, 0.0],
                    [bend * x * y, slope + bend * y * y, 0.0],
                    [0.0, 0.0, 2.0],
                ];
                ([slope * x, slope * y, 2.0 * z], h)
            }
        }
    }

    /// Outward unit normal.
    pub fn normal(self, x: [f64; 3]) -> [f64; 3] {
        let (g, _) = self.differential(x);
        let length = g.iter().map(|c| c * c).sum::<f64>().sqrt();
        g.map(|c| c / length)
    }

    /// Principal curvatures for the outward normal, ascending, from the mean and Gaussian curvature of an
    /// implicit surface (Goldman 2005).
    pub fn curvatures(self, x: [f64; 3]) -> [f64; 2] {
        let (g, h) = self.differential(x);
        let square: f64 = g.iter().map(|c| c * c).sum();
        let along: f64 = (0..3).map(|a| (0..3).map(|b| g[a] * h[a][b] * g[b]).sum::<f64>()).sum();
        let trace = h[0][0] + h[1][1] + h[2][2];
        let mean = (square * trace - along) / (2.0 * square.powf(1.5));
        let cofactor = |a: usize, b: usize| {
            let (p, q, r, s) = ((a + 1) % 3, (a + 2) % 3, (b + 1) % 3, (b + 2) % 3);
            h[p][r] * h[q][s] - h[p][s] * h[q][r]
        };
        let adjugate: f64 = (0..3).map(|a| (0..3).map(|b| g[a] * cofactor(a, b) * g[b]).sum::<f64>()).sum();
        let gaussian = adjugate / (square * square);
        let root = (mean * mean - gaussian).max(0.0).sqrt();
        [mean - root, mean + root]
    }
}

fn sphere(n: usize, random: Option<&mut Random>) -> Cloud {
    match random {
        None => fibonacci_sphere(n),
        Some(random) => random_sphere(n, random),
    }
}

fn square(n: usize, random: Option<&mut Random>) -> Cloud {
    match random {
        None => square_grid(n.isqrt()),
        Some(random) => random_cube(n, 2, random),
    }
}

fn torus(n: usize, random: Option<&mut Random>) -> Vec<[f64; 3]> {
    let regular = |i: usize| {
        let share = (i as f64 + 0.5) / n as f64;
        on_torus((i as f64 * (5f64.sqrt() - 1.0) / 2.0).fract(), angle_of_share(share))
    };
    match random {
        None => (0..n).map(regular).collect(),
        Some(random) => {
            (0..n).map(|_| on_torus(random.uniform(), angle_of_share(random.uniform()))).collect()
        }
    }
}

fn on_torus(turn: f64, v: f64) -> [f64; 3] {
    let (u, rho) = (2.0 * PI * turn, 1.0 + TUBE * v.cos());
    [rho * u.cos(), rho * u.sin(), TUBE * v.sin()]
}

/// The angle around the tube below which the given share of the area lies: `v + R₂ sin v = 2π share`.
fn angle_of_share(share: f64) -> f64 {
    let mut v = 2.0 * PI * share;
    for _ in 0..60 {
        v = 2.0 * PI * share - TUBE * v.sin();
    }
    v
}
