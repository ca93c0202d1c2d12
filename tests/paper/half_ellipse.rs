//! Figure "Implied curve of an exact sample consisting of m points along half of an ellipse".
//!
//! The upper half of the ellipse with semi-axes 1 and ½, equidistant parameters, both ends included, Gauss, α = 0. Analytic
//! continuation: level 1 goes on along the ellipse beyond the ends of the sample. Measured from one end in degrees of the
//! parameter, until it is 0.01 away.

use std::f64::consts::PI;

use super::curves::{Station, crossings, ellipse, lengths, points};
use super::errors::largest;
use super::support::{Family, GAUSS, LAPLACE, Surface};
use super::table::Table;

pub fn table() -> Table {
    for (m, f) in [(16, GAUSS), (256, GAUSS), (16, LAPLACE), (256, LAPLACE)] {
        for alpha in [0.0, 1e-12, 1e-10] {
            let r = std::panic::catch_unwind(|| facts(m, f, alpha));
            println!("{m} {f:?} {alpha} {r:?}");
        }
    }
    Table::of_figure("Half an ellipse", &[])
}

fn facts(m: usize, family: Family, alpha: f64) -> [f64; 2] {
    let parameter = |i: f64| PI * i / (m - 1) as f64;
    let sample: Vec<Station> = (0..m).map(|i| ellipse(parameter(i as f64))).collect();
    let between: Vec<Station> = (0..m - 1).map(|i| ellipse(parameter(i as f64 + 0.5))).collect();
    let beyond: Vec<Station> = (1..=180).map(|i| ellipse(-f64::from(i).to_radians())).collect();
    let surface = Surface::of(&points(&sample), family, alpha);
    let continued = lengths(&crossings(&surface, &beyond, 1.0, 0.1));
    let degrees = continued.iter().take_while(|&&distance| distance < 0.01).count() as f64;
    [largest(&lengths(&crossings(&surface, &between, 1.0, 0.1))), degrees]
}
