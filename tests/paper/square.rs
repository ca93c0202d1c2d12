//! Figure "a full square and one with a corner removed".

use super::curves::{Station, crossings, lengths, points};
use super::errors::largest;
use super::support::{Family, GAUSS, LAPLACE, Surface};
use super::table::Table;

pub fn table() -> Table {
    for f in [GAUSS, LAPLACE, Family::Laplace { epsilon: 1e-5 }] {
        for missing in [false, true] {
            let r = std::panic::catch_unwind(|| facts(f, missing));
            println!("{f:?} {missing} {r:?}");
        }
    }
    Table::of_figure("Square", &[])
}

fn facts(family: Family, without_corner: bool) -> Vec<f64> {
    let is_kept = |s: &Station| !(without_corner && s.point[0] > 0.5 && s.point[1] > 0.5);
    let sample: Vec<Station> = (0..64).map(|i| square(f64::from(i) / 16.0)).filter(is_kept).collect();
    let between: Vec<Station> =
        (0..64).map(|i| square((f64::from(i) + 0.5) / 16.0)).filter(is_kept).collect();
    let surface = Surface::of(&points(&sample), family, 0.0);
    let distances = lengths(&crossings(&surface, &between, 1.0, 0.2));
    let rays: Vec<Station> = (0..9)
        .map(|i| {
            let a = (45.0 + 5.0 * f64::from(i - 4)).to_radians();
            Station::new([0.85 * a.cos(), 0.85 * a.sin()], [a.cos(), a.sin()])
        })
        .collect();
    let out = crossings(&surface, &rays, 1.0, 0.8);
    println!("{distances:?} {out:?}");
    vec![largest(&distances)]
}

/// The point at a parameter in [0, 4), one per side of [−1, 1]², with the normal of its side.
fn square(s: f64) -> Station {
    let along = 2.0 * s.fract() - 1.0;
    match s as usize {
        0 => Station::new([along, -1.0], [0.0, -1.0]),
        1 => Station::new([1.0, along], [1.0, 0.0]),
        2 => Station::new([-along, 1.0], [0.0, 1.0]),
        _ => Station::new([-1.0, -along], [-1.0, 0.0]),
    }
}
