//! Figure "Implied curve of an exact sample consisting of m points along half of an ellipse".
//!
//! The sample is the upper half of the ellipse with semi-axes 1 and ½, at equidistant parameters, both ends
//! included, α = 0. By analytic continuation level 1 follows the ellipse beyond the ends of the sample. The
//! continuation is measured from one end, in degrees of the parameter, until level 1 is 0.01 from the
//! ellipse. The whole ellipse would be 180. The paper does not name the kernel.

use std::f64::consts::PI;

use super::curves::{Station, crossings, ellipse, lengths, points};
use super::errors::largest;
use super::support::{Family, GAUSS, LAPLACE, Surface};
use super::table::{Paper, Row, Table};

/// Largest distance from the ellipse at which level 1 counts as its continuation.
const TOLERANCE: f64 = 0.01;

/// The table for m = 16 and 256, with two kernels.
pub fn table() -> Table {
    let row = |label: &str, m, family| Row::of(label, Paper::Figure, &facts(m, family));
    Table {
        title: "Half an ellipse, alpha = 0: level 1 half way between the points, and beyond them until 0.01 off",
        columns: vec!["distance, worst", "continued by/deg"],
        rows: vec![
            row("m = 16, Gauss", 16, GAUSS),
            row("m = 256, Gauss", 256, GAUSS),
            row("m = 16, Laplace eps = 1", 16, LAPLACE),
            row("m = 256, Laplace eps = 1", 256, LAPLACE),
        ],
    }
}

fn facts(m: u32, family: Family) -> [f64; 2] {
    let station = |i: f64| ellipse(PI * i / f64::from(m - 1));
    let sample: Vec<Station> = (0..m).map(|i| station(f64::from(i))).collect();
    let between: Vec<Station> = (0..m - 1).map(|i| station(f64::from(i) + 0.5)).collect();
    let beyond: Vec<Station> = (1..=180).map(|i| ellipse(-f64::from(i).to_radians())).collect();
    let surface = Surface::of(&points(&sample), family, 0.0);
    let distances = |stations: &[Station]| lengths(&crossings(&surface, stations, 1.0, 0.1));
    let continued = distances(&beyond).into_iter().take_while(|&distance| distance < TOLERANCE).count();
    [largest(&distances(&between)), continued as f64]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 16 points are 0.15 apart on average, and both kernels are right to 1e-4 between them. Between 256
    /// points the error is rounding times the slope of an ill-conditioned fit, at most 1e-7.
    #[test]
    fn level_1_is_the_ellipse_between_the_points() {
        let table = table();
        println!("{table}");
        for (row, bound) in table.rows.iter().zip([1e-4, 1e-7, 1e-4, 1e-7]) {
            assert!(row.ours()[0] < bound, "{}", row.label);
        }
    }

    /// The reach of analytic continuation depends on the precision of the data. It loses a
    /// quarter of its angle if α = 1e-10 limits the precision instead of rounding. The bounds
    /// leave as much to other roundings.
    #[test]
    fn level_1_continues_the_ellipse_beyond_the_points_and_further_from_more_of_them() {
        let continued: Vec<f64> = table().rows.iter().map(|row| row.ours()[1]).collect();
        assert!(
            continued.iter().zip([21.0, 45.0, 16.0, 39.0]).all(|(found, least)| *found > least),
            "{continued:?}"
        );
        assert!(continued[1] > continued[0] && continued[3] > continued[2], "{continued:?}");
    }
}
