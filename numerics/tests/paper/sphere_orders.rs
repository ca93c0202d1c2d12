//! Convergence orders on the unit sphere, Matérn 3/2 and 5/2, ℓ = 1, α = 0.
//!
//! Orders are in the spacing h ~ m^{−1/2}: each doubling of m divides the error by 2^{order/2}. Relative L²
//! errors are taken at 4,000 random points, the same for every m. Fibonacci points as queries would come
//! close to the cloud where m is near their number. The paper's theorem bounds orders from below. Smooth data
//! converge about twice as fast (errata.md, 11).

use super::common::clouds::fibonacci_sphere;
use super::errors::relative_l2;
use super::shapes::directions;
use super::sphere::{at, laplacian, value};
use super::support::{Family, Surface};
use super::table::{Paper, Row, Table};

const COUNTS: [usize; 4] = [128, 256, 512, 1024];

/// The table of orders from one m to the next.
pub fn table() -> Table {
    Table {
        title: "Sphere, alpha = 0: orders of convergence in L2 of f, of its Laplace-Beltrami, and of rough values",
        columns: vec!["f", "Laplace-Beltrami", "|x3 - 0.1|^1.5"],
        rows: [1, 2].into_iter().flat_map(rows).collect(),
    }
}

/// Rows of the Matérn kernel with ν = order + ½.
fn rows(order: u8) -> Vec<Row> {
    let errors = COUNTS.map(|m| errors(m, Family::Matern { order }));
    let row = |(m, pair): (&[usize], &[[f64; 3]])| {
        let label = format!("Matern {}/2, m = {} to {}", 2 * order + 1, m[0], m[1]);
        let orders = [0, 1, 2].map(|n| 2.0 * (pair[0][n] / pair[1][n]).log2());
        Row::of(label, Paper::Nothing, &orders)
    };
    COUNTS.windows(2).zip(errors.windows(2)).map(row).collect()
}

fn errors(m: usize, family: Family) -> [f64; 3] {
    let surface = Surface::of(&fibonacci_sphere(m), family, 0.0);
    let queries = directions(4000, 5000);
    let smooth = surface.function(&at(surface.cloud(), value));
    let rough = surface.function(&at(surface.cloud(), rough_value));
    let (_, laplacians) = smooth.surface_derivatives(&queries);
    [
        relative_l2(&smooth.values(&queries), &at(&queries, value)),
        relative_l2(&laplacians, &at(&queries, laplacian)),
        relative_l2(&rough.values(&queries), &at(&queries, rough_value)),
    ]
}

/// The function `|x₃ − 0.1|^{3/2}`. It has 2 − ε weak derivatives in L², so the order is 2 for any kernel.
fn rough_value(x: &[f64]) -> f64 {
    (x[2] - 0.1).abs().powf(1.5)
}

#[test]
fn smooth_values_converge_at_twice_the_order_of_the_theorem_and_rough_ones_at_theirs() {
    let table = table();
    println!("{table}");
    for (row, nu) in table.rows.iter().zip([1.5, 1.5, 1.5, 2.5, 2.5, 2.5]) {
        let [f, laplacian, rough] = row.ours()[..] else { unreachable!() };
        assert!(f >= 2.0 * nu + 1.0, "{}: {f}", row.label);
        assert!(laplacian >= 2.0 * nu - 0.5, "{}: {laplacian}", row.label);
        assert!((rough - 2.0).abs() <= 0.4, "{}: {rough}", row.label);
    }
}
