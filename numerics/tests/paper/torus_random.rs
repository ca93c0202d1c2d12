//! Table "Randomly sampled torus": principal curvatures, median of 20 clouds.

use rayon::prelude::*;

use super::common::clouds::random_torus;
use super::errors::medians;
use super::random::Random;
use super::support::{Family, GAUSS, LAPLACE, Surface};
use super::table::{Row, Table};
use super::torus::{ALPHA, COLUMNS, errors};

/// The paper's rows: m, L∞ of both curvatures, then L² of both, in the paper's order ("by size").
type Paper = [(usize, [f64; 4]); 5];

const PAPER_GAUSS: Paper = [
    (64, [1.85e-1, 1.72e-1, 9.88e-2, 4.41e-2]),
    (128, [1.77e-2, 1.61e-2, 1.41e-2, 5.24e-3]),
    (256, [5.09e-5, 1.74e-4, 8.33e-4, 2.75e-4]),
    (512, [2.23e-8, 1.19e-7, 2.25e-7, 7.86e-8]),
    (1024, [1.75e-8, 1.36e-8, 5.99e-8, 2.33e-8]),
];
const PAPER_LAPLACE: Paper = [
    (64, [1.02e-1, 2.21e-1, 2.20e-1, 1.33e-1]),
    (128, [5.26e-2, 1.08e-1, 1.72e-2, 9.56e-3]),
    (256, [8.61e-3, 7.94e-3, 2.01e-3, 9.18e-4]),
    (512, [1.59e-3, 9.46e-4, 1.08e-3, 3.64e-4]),
    (1024, [8.51e-6, 4.18e-6, 3.78e-6, 1.39e-6]),
];

/// The table of the Gauss kernel. The paper's entry for m = 256 cannot be right (errata.md, 12).
pub fn table_gauss() -> Table {
    let title = "Random torus, Gauss, alpha = 1e-10: relative error of the curvatures, median of 20 clouds";
    table(title, GAUSS, &PAPER_GAUSS)
}

/// The table of the Laplace kernel, ε = 1.
pub fn table_laplace() -> Table {
    let title =
        "Random torus, Laplace eps = 1, alpha = 1e-10: relative error of the curvatures, median of 20 clouds";
    table(title, LAPLACE, &PAPER_LAPLACE)
}

fn table(title: &'static str, family: Family, paper: &Paper) -> Table {
    let row = |&(m, paper): &(usize, [f64; 4])| {
        let runs: Vec<[f64; 4]> = (0..20).into_par_iter().map(|seed| run(m, family, seed)).collect();
        Row::beside(format!("m = {m}"), &paper, &medians(&runs))
    };
    Table { title, columns: COLUMNS.to_vec(), rows: paper.iter().map(row).collect() }
}

fn run(m: usize, family: Family, seed: u64) -> [f64; 4] {
    let mut random = Random::of_seed(1000 + seed);
    let surface = Surface::of(&random_torus(m, &mut random), family, ALPHA);
    errors(&surface, random.angle())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bounds are set only at m = 1,024. Below it the largest hole of a cloud determines its errors, which
    /// differ by more than a decade from cloud to cloud. At 1,024 Gauss is at the limit of α, 1e-8, in every
    /// cloud. The bound is 10 times that.
    #[test]
    fn with_1024_points_gauss_curvatures_are_right_to_1e_7() {
        let table = table_gauss();
        println!("{table}");
        assert!(table.row("m = 1024").ours().iter().all(|&error| error < 1e-7));
        assert_errors_fall(&table);
    }

    /// The bound is 7 times the paper's entry, whose cloud is one of those that differ by a decade.
    #[test]
    fn with_1024_points_laplace_curvatures_are_right_to_6e_5() {
        let table = table_laplace();
        println!("{table}");
        assert!(table.row("m = 1024").ours().iter().all(|&error| error < 6e-5));
        assert_errors_fall(&table);
    }

    /// Asserts convergence: doubling the points at least halves the median error.
    fn assert_errors_fall(table: &Table) {
        for pair in table.rows.windows(2) {
            let falls =
                pair[0].ours().iter().zip(&pair[1].ours()).all(|(before, after)| *after < 0.5 * before);
            assert!(falls, "{} to {}", pair[0].label, pair[1].label);
        }
    }
}
