//! Meshes of bodies from random points with nothing chosen: topology, volume, and vertices far from all
//! points.

use std::f64::consts::PI;

use gramian_numerics::points::cloud::Cloud;

use crate::common::clouds::fibonacci_sphere;
use crate::common::random::Random;
use crate::support::{OPTIONS, local, meshed, volume};

#[derive(Debug, Clone, Copy)]
enum Body {
    Cube,
    Cone,
    Bumpy,
    Star,
    /// A sphere of radius 1 and one of 0.4, half a radius apart.
    TwoSpheres,
    Ellipsoid,
}

const BODIES: [Body; 6] =
    [Body::Cube, Body::Cone, Body::Bumpy, Body::Star, Body::TwoSpheres, Body::Ellipsoid];

impl Body {
    /// Radius in a direction, for bodies that are seen whole from the origin.
    fn radius(self, [x, y, z]: [f64; 3]) -> f64 {
        match self {
            Self::Bumpy => 1.0 + 0.1 * (5.0 * x).sin() * (5.0 * y).sin() + 0.05 * (6.0 * z).sin(),
            Self::Star => 0.4 + 0.9 * (x.powi(4) + y.powi(4) + z.powi(4)),
            _ => (x * x + (y / 0.7).powi(2) + (z / 0.5).powi(2)).sqrt().recip(),
        }
    }

    fn point(self, random: &mut Random) -> [f64; 3] {
        match self {
            Self::Cube => {
                let mut x: [f64; 3] = std::array::from_fn(|_| 2.0 * random.uniform() - 1.0);
                let side = (random.uniform() * 6.0) as usize;
                x[side % 3] = if side < 3 { 1.0 } else { -1.0 };
                x
            }
            Self::Cone => {
                // Of π + π√5, the base has π.
                let is_base = random.uniform() * (1.0 + 5f64.sqrt()) < 1.0;
                let (share, (s, c)) = (random.uniform().sqrt(), random.angle().sin_cos());
                [share * c, share * s, if is_base { 0.0 } else { 2.0 * (1.0 - share) }]
            }
            Self::TwoSpheres => {
                let is_small = random.uniform() < 0.16 / 1.16;
                let [x, y, z] = random.on_sphere();
                if is_small { [1.9 + 0.4 * x, 0.4 * y, 0.4 * z] } else { [x, y, z] }
            }
            Self::Bumpy | Self::Star | Self::Ellipsoid => {
                let direction = random.on_sphere();
                direction.map(|c| self.radius(direction) * c)
            }
        }
    }

    fn volume(self) -> f64 {
        let radial = || {
            let lattice = fibonacci_sphere(20_000);
            let cubes = lattice.points().map(|u| self.radius([u[0], u[1], u[2]]).powi(3));
            4.0 * PI / 3.0 * cubes.sum::<f64>() / 20_000.0
        };
        match self {
            Self::Cube => 8.0,
            Self::Cone => 2.0 * PI / 3.0,
            Self::TwoSpheres => 4.0 * PI / 3.0 * (1.0 + 0.064),
            Self::Bumpy | Self::Star | Self::Ellipsoid => radial(),
        }
    }

    fn n_parts(self) -> usize {
        if matches!(self, Self::TwoSpheres) { 2 } else { 1 }
    }
}

#[test]
fn bodies_of_any_size_are_meshed_whole() {
    let mut n_other = 0;
    for body in BODIES {
        for n in [300, 800, 2500, 4500, 9000] {
            let mut random = Random(n as u64);
            let points: Vec<[f64; 3]> = (0..n).map(|_| body.point(&mut random)).collect();
            let surface = local(Cloud::new(points.concat(), 3).unwrap());
            let (found, _) = meshed(&surface, &OPTIONS);
            let of_parts: Vec<i64> = found.parts.iter().map(|part| part.euler_characteristic).collect();
            let share = volume(&found.mesh) / body.volume();
            let n_far: usize = found.parts.iter().map(|part| part.n_far).sum();
            assert!((0.95..1.05).contains(&share), "{body:?}, {n}: volume {share}");
            assert!(100 * n_far <= found.mesh.n_vertices(), "{body:?}, {n}: {n_far} far vertices");
            n_other += usize::from(of_parts != vec![2; body.n_parts()]);
        }
    }
    // One cone has two small handles, where a few normals beside its tip point to the wrong side. With the
    // dense function, cubes of 3,600 to 5,000 points had 140 of them, and 61 % of their volume was missing.
    assert!(n_other <= 1, "{n_other} of 30 bodies have another topology");
}
