//! Clouds that are hard on searches: repeated positions, many scales, ties, many dimensions.

#![allow(dead_code, reason = "each test takes what it needs")]

use gramian_numerics::points::cloud::Cloud;

use super::random::Random;

/// A named cloud with any number of points.
pub struct Hostile {
    pub name: &'static str,
    pub dimension: usize,
    /// Writes the coordinates of one point. Arguments: its index, the number of points,
    /// random numbers, coordinates.
    point: fn(usize, usize, &mut Random, &mut [f64]),
}

const fn hostile(
    name: &'static str,
    dimension: usize,
    point: fn(usize, usize, &mut Random, &mut [f64]),
) -> Hostile {
    Hostile { name, dimension, point }
}

impl Hostile {
    pub fn cloud(&self, n_points: usize) -> Cloud {
        let mut random = Random(29);
        let mut coordinates = vec![0.0; n_points * self.dimension];
        for (at, x) in coordinates.chunks_exact_mut(self.dimension).enumerate() {
            (self.point)(at, n_points, &mut random, x);
        }
        Cloud::new(coordinates, self.dimension).unwrap()
    }

    /// Random points in the unit cube of the same dimension, for comparison.
    pub fn ordinary(&self) -> Self {
        hostile("random", self.dimension, |_, _, random, x| uniform(random, x))
    }
}

fn uniform(random: &mut Random, x: &mut [f64]) {
    x.iter_mut().for_each(|x| *x = random.uniform());
}

/// A position out of `n_positions` random ones, each taken equally often.
fn repeated(n_positions: usize, at: usize, x: &mut [f64]) {
    uniform(&mut Random((at % n_positions) as u64), x);
}

/// Point `at` of a cubic lattice of `side` points along each axis.
fn lattice(side: usize, at: usize, x: &mut [f64]) {
    let mut rest = at;
    for x in x {
        *x = (rest % side) as f64;
        rest /= side;
    }
}

/// The side of the smallest cubic lattice of at least n points.
fn side_of(n: usize) -> usize {
    (1..).find(|side| side * side * side >= n).unwrap_or(1)
}

pub const HOSTILE: [Hostile; 24] = [
    hostile("all at one position", 3, |_, _, _, x| x.fill(0.25)),
    hostile("5 positions", 3, |at, _, _, x| repeated(5, at, x)),
    hostile("100 positions", 3, |at, _, _, x| repeated(100, at, x)),
    hostile("every position twice", 3, |at, n, _, x| repeated(n / 2, at, x)),
    hostile("half at one position, half random", 3, |at, _, random, x| match at % 2 {
        0 => x.fill(0.5),
        _ => uniform(random, x),
    }),
    hostile("a line along an axis", 3, |_, _, random, x| x[0] = random.uniform()),
    hostile("a line askew", 3, |at, n, _, x| x.fill(at as f64 / n as f64)),
    hostile("two parallel lines", 2, |at, n, _, x| {
        x[0] = at as f64 / n as f64;
        x[1] = 0.01 * (at % 2) as f64;
    }),
    hostile("a plane and an outlier", 3, |at, _, random, x| {
        uniform(random, x);
        x[0] = if at == 0 { 1e6 } else { 0.0 };
    }),
    hostile("a cluster of 1e-9 in a cube of 1", 3, |at, _, random, x| {
        uniform(random, x);
        if at % 2 == 0 {
            x.iter_mut().for_each(|x| *x *= 1e-9);
        }
    }),
    hostile("heavy tails", 3, |_, _, random, x| {
        x.iter_mut().for_each(|x| *x = random.normal() / random.uniform().powi(3).max(1e-60));
    }),
    hostile("a geometric sequence", 1, |at, _, random, x| {
        x[0] = 0.5f64.powf(1000.0 * random.uniform()) * (1 + at % 3) as f64;
    }),
    hostile("geometric sequences along each axis", 3, |_, _, random, x| {
        x.iter_mut().for_each(|x| *x = 0.5f64.powi((1050.0 * random.uniform()) as i32));
    }),
    hostile("a cube of 1e-310", 3, |_, _, random, x| {
        uniform(random, x);
        x.iter_mut().for_each(|x| *x *= 1e-310);
    }),
    hostile("a cube of 1e-200 and one point far from it", 3, |at, _, random, x| {
        uniform(random, x);
        x.iter_mut().for_each(|x| *x *= if at == 0 { 1.0 } else { 1e-200 });
    }),
    hostile("a cube of 1e-160", 3, |_, _, random, x| {
        uniform(random, x);
        x.iter_mut().for_each(|x| *x *= 1e-160);
    }),
    hostile("a lattice", 3, |at, n, _, x| lattice(side_of(n), at, x)),
    hostile("a lattice, every position ten times", 3, |at, n, _, x| {
        let n_positions = n.div_ceil(10);
        lattice(side_of(n_positions), at % n_positions, x);
    }),
    hostile("a sphere around a cluster at its centre", 3, |at, _, random, x| {
        x.copy_from_slice(&random.on_sphere());
        if at % 2 == 0 {
            x.iter_mut().for_each(|x| *x *= 1e-3);
        }
    }),
    hostile("a sphere around a few points at its centre", 3, |at, _, random, x| {
        x.copy_from_slice(&random.on_sphere());
        if at < 4 {
            x.iter_mut().for_each(|x| *x *= 1e-3);
        }
    }),
    hostile("whole numbers up to 100", 1, |_, _, random, x| x[0] = (100.0 * random.uniform()).floor()),
    hostile("a comb", 2, |at, _, random, x| {
        x[0] = (at % 50) as f64;
        x[1] = 1e4 * random.uniform();
    }),
    hostile("corners of a cube in 16 dimensions", 16, |at, _, _, x| lattice(2, at, x)),
    hostile("axes in 16 dimensions", 16, |at, _, random, x| x[at % 16] = random.uniform()),
];
