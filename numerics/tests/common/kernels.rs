//! Kernel families that several tests run over.

#![allow(dead_code, reason = "each test takes what it needs")]

use gramian_numerics::kernel::{Family, MAX_MATERN_ORDER, WendlandSmoothness};

/// All families, at parameters that a user might choose: 17 kernels.
pub fn all_families() -> Vec<Family> {
    let mut families = vec![
        Family::Gauss,
        Family::Laplace { epsilon: 1.0 },
        Family::Laplace { epsilon: 0.01 },
        Family::Laplace { epsilon: 0.0 },
        Family::Wendland { smoothness: WendlandSmoothness::C2 },
        Family::Wendland { smoothness: WendlandSmoothness::C4 },
        Family::Wendland { smoothness: WendlandSmoothness::C6 },
        Family::InverseMultiquadric,
    ];
    families.extend((0..=MAX_MATERN_ORDER).map(|order| Family::Matern { order }));
    families
}
