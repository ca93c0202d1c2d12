//! Points on a surface: evenly spaced, random, or denser on one side.

#![allow(dead_code, reason = "every sweep asks for some of it")]

use std::collections::HashMap;

use crate::common::random::Random;
use crate::shapes::Shape;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// Points that keep a distance from one another (Poisson disks).
    Regular,
    /// Uniform in area.
    Random,
    /// Ten times as dense at one end of a diagonal as at the other.
    Biased,
}

pub const SAMPLINGS: [Sampling; 3] = [Sampling::Regular, Sampling::Random, Sampling::Biased];

/// Half the thickness, in f/|∇f|, of the shell in which points are drawn before they
/// are moved onto the surface.
const SHELL: f64 = 0.01;

/// Random points drawn for each point that is kept at a distance from the others.
const DRAWN_PER_KEPT: usize = 6;

/// At least n points of a surface, exactly on it.
pub fn sample(shape: Shape, sampling: Sampling, n: usize, random: &mut Random) -> Vec<[f64; 3]> {
    match sampling {
        Sampling::Regular => keep_apart(&drawn(shape, n * DRAWN_PER_KEPT, &|_| 1.0, random), n),
        Sampling::Random => drawn(shape, n, &|_| 1.0, random),
        Sampling::Biased => drawn(shape, n, &bias, random),
    }
}

fn bias(x: &[f64; 3]) -> f64 {
    let along = ((x[0] + 0.6 * x[1] + 0.3 * x[2]) / 1.2).clamp(-1.0, 1.0);
    (1.15 * (along - 1.0)).exp()
}

fn drawn(shape: Shape, n: usize, share: &dyn Fn(&[f64; 3]) -> f64, random: &mut Random) -> Vec<[f64; 3]> {
    let mut points = Vec::with_capacity(n);
    while points.len() < n {
        let x = shape.half_sides().map(|half| (2.0 * random.uniform() - 1.0) * half);
        let f = shape.level(x);
        let slope = f.gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        // NaN where f has no gradient counts as far.
        let is_near = f.value.abs() < SHELL * slope;
        if !is_near {
            continue;
        }
        let y = shape.project(x);
        let moved = (0..3).map(|c| (y[c] - x[c]).powi(2)).sum::<f64>().sqrt();
        if moved < 2.0 * SHELL && random.uniform() <= share(&y) {
            points.push(y);
        }
    }
    points
}

/// A choice of at least n of the points, as far apart from one another as that allows.
fn keep_apart(points: &[[f64; 3]], n: usize) -> Vec<[f64; 3]> {
    let (mut near, mut far) = (0.0, 4.0);
    let mut kept = points.to_vec();
    for _ in 0..18 {
        let middle = 0.5 * (near + far);
        let found = apart_by(points, middle);
        if found.len() < n {
            far = middle;
        } else {
            (near, kept) = (middle, found);
        }
    }
    kept
}

/// Points that are at least a distance from all points kept before them.
fn apart_by(points: &[[f64; 3]], distance: f64) -> Vec<[f64; 3]> {
    let mut cells = HashMap::<[i64; 3], Vec<[f64; 3]>>::new();
    let mut kept = Vec::new();
    for x in points {
        let cell = x.map(|x| (x / distance).floor() as i64);
        let is_near = |y: &[f64; 3]| (0..3).map(|c| (x[c] - y[c]).powi(2)).sum::<f64>() < distance * distance;
        let around = (0..27).map(|i| [cell[0] + i % 3 - 1, cell[1] + i / 3 % 3 - 1, cell[2] + i / 9 - 1]);
        if around.filter_map(|cell| cells.get(&cell)).flatten().any(is_near) {
            continue;
        }
        cells.entry(cell).or_default().push(*x);
        kept.push(*x);
    }
    kept
}
