//! Plane curves with exact normals, and distances of level lines of u from them.

use super::support::{Cloud, Surface, cloud};

/// A point of a curve with its outward normal.
#[derive(Clone, Copy)]
pub struct Station {
    pub point: [f64; 2],
    pub normal: [f64; 2],
}

impl Station {
    /// A point with its normal, from an outward vector of any length.
    pub fn new(point: [f64; 2], outward: [f64; 2]) -> Self {
        let length = outward[0].hypot(outward[1]);
        Self { point, normal: outward.map(|x| x / length) }
    }

    /// The point at a signed distance along the normal.
    pub fn at(&self, distance: f64) -> [f64; 2] {
        [0, 1].map(|c| self.point[c] + distance * self.normal[c])
    }
}

/// The ellipse (cos t, ½ sin t) of the paper's experiments.
pub fn ellipse(t: f64) -> Station {
    Station::new([t.cos(), 0.5 * t.sin()], [0.5 * t.cos(), t.sin()])
}

/// The points of stations as a cloud.
pub fn points(stations: &[Station]) -> Cloud {
    cloud(&stations.iter().map(|station| station.point).collect::<Vec<_>>())
}

/// Steps of the search on each side of a curve.
const STEPS: i32 = 30;
/// Number of bisections, which locate the crossing to 1e-9 of the reach.
const HALVINGS: usize = 25;

/// Signed distance along each normal to the nearest crossing of `u = level`, `None`
/// if none is within `reach`.
///
/// Samples u in steps of reach/30 on both sides of the curve, then bisects.
pub fn crossings(surface: &Surface, stations: &[Station], level: f64, reach: f64) -> Vec<Option<f64>> {
    let offsets: Vec<f64> = (-STEPS..=STEPS).map(|i| reach * f64::from(i) / f64::from(STEPS)).collect();
    let scan: Vec<[f64; 2]> = stations.iter().flat_map(|s| offsets.iter().map(|&at| s.at(at))).collect();
    let levels = surface.levels(&cloud(&scan));
    let mut brackets: Vec<Option<[f64; 2]>> =
        levels.chunks(offsets.len()).map(|u| nearest_bracket(&offsets, u, level)).collect();
    for _ in 0..HALVINGS {
        halve(surface, stations, level, &mut brackets);
    }
    brackets.into_iter().map(|bracket| bracket.map(|[a, _]| a)).collect()
}

/// The pair of adjacent offsets nearest to 0 with `u ≥ level` at the first and `u < level` at the second.
fn nearest_bracket(offsets: &[f64], u: &[f64], level: f64) -> Option<[f64; 2]> {
    (1..offsets.len())
        .filter(|&i| (u[i - 1] >= level) != (u[i] >= level))
        .map(|i| if u[i] >= level { [offsets[i], offsets[i - 1]] } else { [offsets[i - 1], offsets[i]] })
        .min_by(|a, b| (a[0] + a[1]).abs().total_cmp(&(b[0] + b[1]).abs()))
}

fn halve(surface: &Surface, stations: &[Station], level: f64, brackets: &mut [Option<[f64; 2]>]) {
    let middle = |(s, b): (&Station, &Option<[f64; 2]>)| b.map_or(s.point, |[a, b]| s.at((a + b) / 2.0));
    let middles: Vec<[f64; 2]> = stations.iter().zip(&*brackets).map(middle).collect();
    for (bracket, u) in brackets.iter_mut().zip(surface.levels(&cloud(&middles))) {
        if let Some([a, b]) = bracket {
            let middle = (*a + *b) / 2.0;
            *(if u >= level { a } else { b }) = middle;
        }
    }
}

/// Angles in degrees between served outward normals and the normals of the stations.
///
/// Normals are asked at the level line, which passes each station at the given distance. NaN where there is
/// no level line or no normal.
pub fn angles(surface: &Surface, stations: &[Station], distances: &[Option<f64>]) -> Vec<f64> {
    let crossing = |(s, d): (&Station, &Option<f64>)| s.at(d.unwrap_or(0.0));
    let queries: Vec<[f64; 2]> = stations.iter().zip(distances).map(crossing).collect();
    let normals = surface.normals(&cloud(&queries));
    let angle = |((station, distance), normal): ((&Station, &Option<f64>), &Option<Vec<f64>>)| match normal {
        Some(normal) if distance.is_some() => degrees_between(normal, &station.normal),
        _ => f64::NAN,
    };
    stations.iter().zip(distances).zip(&normals).map(angle).collect()
}

/// Angles in degrees of the normals at the stations themselves.
pub fn angles_on_curve(surface: &Surface, stations: &[Station]) -> Vec<f64> {
    angles(surface, stations, &vec![Some(0.0); stations.len()])
}

fn degrees_between(a: &[f64], b: &[f64]) -> f64 {
    let (dot, cross) = (a[0] * b[0] + a[1] * b[1], a[0] * b[1] - a[1] * b[0]);
    cross.abs().atan2(dot).to_degrees()
}

/// Magnitudes of distances, NaN where there is none.
pub fn lengths(distances: &[Option<f64>]) -> Vec<f64> {
    distances.iter().map(|distance| distance.map_or(f64::NAN, f64::abs)).collect()
}

/// Number of rays in [`rays_crossed_once`]. Each is half a degree off whole degrees, so none meets a corner.
pub const N_RAYS: u32 = 360;

/// Counts the rays from the origin, of [`N_RAYS`], that level 1 crosses exactly once within `reach`.
///
/// All are counted if level 1 is a simple closed curve, star-shaped around the origin, and nothing else.
pub fn rays_crossed_once(surface: &Surface, reach: f64) -> usize {
    const STEPS_PER_RAY: usize = 200;
    let ray = |i: u32| {
        let (sin, cos) = (f64::from(i) + 0.5).to_radians().sin_cos();
        let radius = move |step: usize| reach * step as f64 / STEPS_PER_RAY as f64;
        (1..=STEPS_PER_RAY).map(move |step| [radius(step) * cos, radius(step) * sin])
    };
    let levels = surface.levels(&cloud(&(0..N_RAYS).flat_map(ray).collect::<Vec<_>>()));
    let n_crossings = |u: &[f64]| u.windows(2).filter(|u| (u[0] >= 1.0) != (u[1] >= 1.0)).count();
    levels.chunks(STEPS_PER_RAY).filter(|u| n_crossings(u) == 1).count()
}
