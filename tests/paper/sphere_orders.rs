//! Convergence orders on the unit sphere, Matérn 3/2 and 5/2, α = 0 (errata.md, 11).

use super::errors::relative_l2;
use super::shapes::sphere;
use super::sphere::{at, laplacian, value};
use super::support::{Family, Surface, cloud};
use super::table::{Paper, Row, Table};

const COUNTS: [usize; 5] = [128, 256, 512, 1024, 2048];

pub fn table() -> Table {
    let rows = [1, 2].into_iter().flat_map(|order| {
        let family = Family::Matern { order };
        let e: Vec<[f64; 3]> = COUNTS.iter().map(|&m| errors(m, family)).collect();
        println!("{e:?}");
        (1..COUNTS.len()).map(move |i| {
            let o: [f64; 3] = std::array::from_fn(|c| 2.0 * (e[i - 1][c] / e[i][c]).log2());
            Row::of(
                format!("Matern {}/2, m = {} to {}", 2 * order + 1, COUNTS[i - 1], COUNTS[i]),
                Paper::Nothing,
                &o,
            )
        })
    });
    Table {
        title: "Sphere: orders",
        columns: vec!["f", "Laplace-Beltrami", "|x3 - 0.1|^1.5"],
        rows: rows.collect(),
    }
}

fn errors(m: usize, family: Family) -> [f64; 3] {
    let surface = Surface::of(&cloud(&sphere(m)), family, 0.0);
    let queries = cloud(&sphere(4000));
    let f = surface.function(&at(surface.cloud(), value));
    let rough = surface.function(&at(surface.cloud(), rough_value));
    let (_, laplacians) = f.surface_derivatives(&queries);
    [
        relative_l2(&f.values(&queries), &at(&queries, value)),
        relative_l2(&laplacians, &at(&queries, laplacian)),
        relative_l2(&rough.values(&queries), &at(&queries, rough_value)),
    ]
}

fn rough_value(x: &[f64]) -> f64 {
    (x[2] - 0.1).abs().powf(1.5)
}
