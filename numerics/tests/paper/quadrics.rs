//! Tables "Quadratic surface": z = ax²/2 − by²/2 over [−½, ½]², 256 points, principal curvatures at the
//! origin, α = 1e-10.
//!
//! Curvatures are for ν = +∇u/|∇u|, as in the paper: a and −b. For a = b the symmetry leaves the signature
//! function no gradient at the origin. The paper divides by its rounding. The library answers null if it may
//! use only the signature function, and otherwise asks the offset model.

use super::errors::medians;
use super::random::Random;
use super::support::{Cloud, Family, GAUSS, LAPLACE, Orientation, Surface, SurfaceModel, cloud};
use super::table::{Cell, Paper, Row, Table};

const ALPHA: f64 = 1e-10;

/// The table: a = 1, b = 2 and a = b = 1, on the grid and on random points.
pub fn table() -> Table {
    let nothing = [Paper::Nothing; 2];
    let (asymmetric, saddle) = ([grids(2.0), random_patches(2.0)], [grids(1.0), random_patches(1.0)]);
    let answered = |label, clouds: &[Cloud], family, paper, model| {
        row(label, clouds, paper, |cloud| curvatures(cloud, family, model))
    };
    let row = |label, clouds, family, paper| answered(label, clouds, family, paper, SurfaceModel::Signature);
    let rescued = |label, clouds, family, paper| answered(label, clouds, family, paper, SurfaceModel::Auto);
    Table {
        title: "Quadrics z = (a x^2 - b y^2)/2: curvatures at the origin, alpha = 1e-10; random: median of 20 clouds",
        columns: vec!["kappa = a", "kappa = -b", "clouds with null"],
        rows: vec![
            row("a = 1, b = 2, grid, Gauss", &asymmetric[0], GAUSS, numbers(1.0, -2.0)),
            row("a = 1, b = 2, grid, Laplace", &asymmetric[0], LAPLACE, numbers(1.003, -1.992)),
            row("a = 1, b = 2, random, Gauss", &asymmetric[1], GAUSS, nothing),
            row("a = 1, b = 2, random, Laplace", &asymmetric[1], LAPLACE, nothing),
            row("a = b = 1, grid, Gauss", &saddle[0], GAUSS, numbers(-3.1650e5, -4.4615e10)),
            row("a = b = 1, grid, Laplace", &saddle[0], LAPLACE, numbers(3.5405e7, -3.8913e9)),
            row("a = b = 1, random, Gauss", &saddle[1], GAUSS, nothing),
            row("a = b = 1, random, Laplace", &saddle[1], LAPLACE, numbers(0.98534, -1.0138)),
            rescued("... with rescue, grid, Gauss", &saddle[0], GAUSS, nothing),
            rescued("... with rescue, grid, Laplace", &saddle[0], LAPLACE, nothing),
            rescued("... with rescue, random, Gauss", &saddle[1], GAUSS, nothing),
            rescued("... with rescue, random, Laplace", &saddle[1], LAPLACE, nothing),
        ],
    }
}

fn numbers(a: f64, b: f64) -> [Paper; 2] {
    [Paper::Number(a), Paper::Number(b)]
}

/// A row with the median over the clouds and the number of nulls. The median is null if most clouds are.
fn row(label: &str, clouds: &[Cloud], paper: [Paper; 2], answer: impl Fn(&Cloud) -> Option<[f64; 2]>) -> Row {
    let found: Vec<Option<[f64; 2]>> = clouds.iter().map(answer).collect();
    let regular: Vec<[f64; 2]> = found.iter().copied().flatten().collect();
    let n_null = (found.len() - regular.len()) as f64;
    let ours = (2 * regular.len() > found.len()).then(|| medians(&regular));
    let cell = |n: usize| Cell { paper: paper[n], ours: ours.map(|ours| ours[n]) };
    let count = Cell { paper: Paper::Nothing, ours: Some(n_null) };
    Row { label: label.to_owned(), cells: vec![cell(0), cell(1), count] }
}

/// The curvatures at the origin by a model, the larger one first, or `None` without an answer.
fn curvatures(cloud: &Cloud, family: Family, model: SurfaceModel) -> Option<[f64; 2]> {
    let origin = Cloud::new(vec![0.0; 3], 3).unwrap();
    let surface = Surface::with_model(cloud, family, ALPHA, model);
    surface.curvatures(&origin, Orientation::Gradient)[0].as_ref().map(|k| [k[1], k[0]])
}

/// The patch over the paper's regular 16 × 16 grid, which contains the boundary.
fn grids(b: f64) -> Vec<Cloud> {
    let coordinate = |i: usize| i as f64 / 15.0 - 0.5;
    vec![patch(b, (0..256).map(|i| [coordinate(i / 16), coordinate(i % 16)]))]
}

fn random_patches(b: f64) -> Vec<Cloud> {
    let patch_of = |seed: u64| {
        let mut random = Random::of_seed(2000 + seed);
        patch(b, (0..256).map(|_| [random.uniform() - 0.5, random.uniform() - 0.5]))
    };
    (0..20).map(patch_of).collect()
}

/// The patch over points of the plane, with a = 1.
fn patch(b: f64, points: impl Iterator<Item = [f64; 2]>) -> Cloud {
    cloud(&points.map(|[x, y]| [x, y, (x * x - b * y * y) / 2.0]).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The paper's own errors on the grid are 0.003 and 0.008 (Laplace), and the bounds are half of
    /// these. The random patches have holes of twice the grid's spacing, but still resolve curvatures
    /// with radii of at least ½.
    #[test]
    fn both_kernels_find_the_curvatures_of_the_asymmetric_saddle() {
        let table = table();
        println!("{table}");
        for row in &table.rows[..4] {
            let [a, minus_b, n_null] = row.ours()[..] else { unreachable!() };
            assert!((a - 1.0).abs() < 0.0015 && (minus_b + 2.0).abs() < 0.004, "{}", row.label);
            assert_eq!(n_null, 0.0, "{}", row.label);
        }
    }

    #[test]
    fn the_symmetric_saddle_is_null_instead_of_wrong() {
        for row in &table().rows[4..8] {
            assert!(row.cells[0].ours.is_none() && row.cells[1].ours.is_none(), "{}", row.label);
        }
    }

    /// The bound 1e-3 holds in every cloud, not only in the median. Which side of a saddle is outward is
    /// arbitrary, but with a = b both sides have the same curvatures.
    #[test]
    fn the_symmetric_saddle_is_right_with_the_offset_model() {
        for cloud in grids(1.0).iter().chain(&random_patches(1.0)) {
            for family in [GAUSS, LAPLACE] {
                let [a, minus_b] = curvatures(cloud, family, SurfaceModel::Auto).unwrap();
                assert!((a - 1.0).abs() < 1e-3 && (minus_b + 1.0).abs() < 1e-3, "{family:?}: {a}, {minus_b}");
            }
        }
    }
}
