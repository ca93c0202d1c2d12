//! Eigenvalues of sparse operators on scans.

use std::sync::Arc;

use faer::Mat;
use gramian_numerics::observer::Unobserved;
use gramian_numerics::operators::{Operator, RowKind, Stencils};
use gramian_numerics::points::cloud::Cloud;
use gramian_numerics::points::sampling::Sampling;
use gramian_numerics::surface::Surface;
use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};
use gramian_numerics::surface::local::{LocalInputs, LocalSurface};

use crate::bunny::bunny;

fn stencils(cloud: &Cloud) -> Stencils {
    let cloud = Arc::new(cloud.clone());
    let sampling = Arc::new(Sampling::of(&cloud, &Unobserved).unwrap());
    let surface =
        LocalSurface::of(cloud.clone(), sampling.clone(), LocalInputs::default(), &Unobserved).unwrap();
    let geometry =
        Geometry::of(&Surface::from(surface), &cloud, &GeometryRequest::CURVATURES, &Unobserved).unwrap();
    Operator::LaplaceBeltrami.stencils(&geometry, &cloud, sampling.neighbours(), &cloud, &Unobserved).unwrap()
}

#[test]
fn the_bunny_has_no_eigenvalue_with_positive_real_part() {
    let (cloud, _) = bunny();
    let half: Vec<f64> = cloud.points().step_by(2).flatten().copied().collect();
    let n = half.len() / 3;
    let found = stencils(&Cloud::new(half, 3).unwrap());
    println!("bunny: {} of {n} rows graded", found.n_rows(RowKind::Graded));
    let mut matrix = Mat::zeros(n, n);
    let csr = &found.matrix;
    for row in 0..n {
        for at in csr.indptr[row] as usize..csr.indptr[row + 1] as usize {
            matrix[(row, csr.indices[at] as usize)] = csr.data[at];
        }
    }
    let eigenvalues = matrix.eigenvalues().unwrap();
    let radius = eigenvalues.iter().fold(0.0, |a: f64, z| a.max(z.norm()));
    let rightmost = eigenvalues.iter().fold(f64::NEG_INFINITY, |a, z| a.max(z.re));
    assert!(rightmost < 1e-8 * radius, "{rightmost:e} of {radius:e}");
    assert_eq!(found.n_rows(RowKind::Empty), 0);
}
