//! Paths compared with single evaluations.

use super::*;
use crate::error::NumericsError;
use crate::kernel::Family;
use crate::observer::Unobserved;
use crate::points::cloud::Cloud;
use crate::regression::selection::evaluation::Evaluator;
use crate::regression::solver::trend::Mean;
use crate::testing::Random;

const CRITERIA: [Criterion; 3] =
    [Criterion::MarginalLikelihood, Criterion::LeaveOneOut, Criterion::GeneralizedCrossValidation];

fn at(noise: f64) -> Hyperparameters {
    Hyperparameters {
        family: Family::Matern { order: 1 },
        length_scales: vec![0.6, 1.3],
        variance: 1.5,
        noise: Regularization::Uniform(noise),
    }
}

#[test]
fn every_alpha_has_the_score_that_it_has_alone() {
    let random = &mut Random(31);
    let cloud = Cloud::new((0..2 * 70).map(|_| random.uniform()).collect(), 2).unwrap();
    let values: Vec<f64> = cloud.points().map(|x| 5.0 + (4.0 * x[0]).sin() + 0.1 * random.normal()).collect();
    let kernel = at(0.0).kernel_on(&cloud).unwrap();
    // More α than are handled together.
    let alphas = default_alphas(70, &kernel, 300);
    for mean in [Mean::Zero, Mean::Constant, Mean::Linear] {
        let data = Observations { cloud: &cloud, values: &values, mean };
        let subject = Subject::of(data).unwrap();
        for criterion in CRITERIA {
            let path = alpha_path(data, &at(9.0), &alphas, criterion, &Unobserved).unwrap();
            assert_eq!(path.len(), 300);
            let own = Subject::of(data).unwrap();
            let few = Path { subject: own, at: &at(9.0), alphas: &alphas[..3], criterion };
            let by_factors = few.by_factors(&Unobserved).unwrap();
            assert!(path.iter().zip(&by_factors).all(|(a, b)| (a - b).abs() < 1e-8 * b.abs()));
            for (found, &alpha) in path.iter().zip(&alphas).step_by(17) {
                let mut evaluator = Evaluator::new(&subject, criterion, false);
                let expected = evaluator.score(&at(alpha), &Unobserved).unwrap().unwrap().score;
                let error = (found - expected).abs();
                assert!(
                    error < 1e-8 * expected.abs(),
                    "{mean:?} {criterion:?} {alpha:e}: {found} {expected}"
                );
            }
        }
    }
}

#[test]
fn matrices_that_are_not_definite_have_no_score() {
    let cloud = Cloud::new(vec![0.0, 0.0, 1.0, 2.0], 1).unwrap();
    let kernel = Hyperparameters { length_scales: vec![1.0], ..at(0.0) };
    for criterion in CRITERIA {
        let data = Observations { cloud: &cloud, values: &[1.0, 2.0, 3.0, 4.0], mean: Mean::Zero };
        let path = alpha_path(data, &kernel, &[0.0, 0.1], criterion, &Unobserved).unwrap();
        assert!(path[0].is_nan() && path[1].is_finite(), "{path:?}");
        let refused = alpha_path(data, &kernel, &[-1.0], criterion, &Unobserved);
        assert!(matches!(refused, Err(NumericsError::InvalidRegularization { .. })));
    }
}

#[test]
fn default_alphas_rise_in_equal_ratios() {
    let kernel = Kernel::new(Family::Gauss, 1.0, 4.0).unwrap();
    let alphas = default_alphas(100, &kernel, 50);
    assert!((alphas[49] - 400.0).abs() < 1e-9 && alphas[0] > 0.0);
    let ratio = alphas[1] / alphas[0];
    assert!(alphas.windows(2).all(|pair| (pair[1] / pair[0] / ratio - 1.0).abs() < 1e-9));
    assert!(default_alphas(100, &kernel, 0).is_empty() && default_alphas(100, &kernel, 1).len() == 1);
}
