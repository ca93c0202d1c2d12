//! Functions on space with their derivatives, smooth and rough.

use crate::jet::Jet;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Field {
    /// A plane with a slight quadratic bend.
    Affine,
    /// Waves longer than the width of a surface of radius 1.
    Low,
    /// Waves about as long as the radius of the surface.
    Mid,
    /// Waves about a third as long as the radius of the surface.
    High,
    /// A smooth step of width 0.15.
    Front,
}

pub const FIELDS: [Field; 5] = [Field::Affine, Field::Low, Field::Mid, Field::High, Field::Front];

/// A wave: wave vector, phase and amplitude.
type Wave = ([f64; 3], f64, f64);

const LOW: [Wave; 2] = [([1.3, 0.4, -0.6], 0.3, 1.0), ([-0.5, 1.1, 0.9], 1.0, 0.7)];
const MID: [Wave; 3] =
    [([3.0, 1.0, -2.0], 0.3, 1.0), ([-1.0, 2.5, 2.0], 1.0, 0.5), ([0.5, -1.0, 1.0], 2.0, 0.8)];
const HIGH: [Wave; 3] =
    [([7.0, 2.0, -4.0], 0.3, 1.0), ([-3.0, 6.0, 4.0], 1.0, 0.5), ([0.5, -1.0, 1.0], 2.0, 0.8)];

impl Field {
    pub fn at(self, x: [f64; 3]) -> Jet {
        let linear = |w: [f64; 3]| {
            Jet::coordinates(x).into_iter().zip(w).fold(Jet::constant(0.0), |sum, (x, w)| sum + w * x)
        };
        let waves = |waves: &[Wave]| {
            let wave = |&(w, phase, amplitude): &Wave| amplitude * (linear(w) + phase).sin();
            waves.iter().map(wave).fold(Jet::constant(0.0), |sum, wave| sum + wave)
        };
        match self {
            Self::Affine => linear([1.0, 2.0, -1.0]) + 0.01 * linear([0.3, 0.4, 0.5]).squared(),
            Self::Low => waves(&LOW),
            Self::Mid => waves(&MID),
            Self::High => waves(&HIGH),
            Self::Front => ((1.0 / 0.15) * (linear([0.6, 0.5, 0.6]) + -0.1)).tanh(),
        }
    }
}
