//! Forward differentiation to second order in three variables: a surface is written once, as its equation.

use std::ops::{Add, Mul, Sub};

/// A value with its gradient and Hessian.
#[derive(Debug, Clone, Copy)]
pub struct Jet {
    pub value: f64,
    pub gradient: [f64; 3],
    pub hessian: [[f64; 3]; 3],
}

impl Jet {
    pub fn constant(value: f64) -> Self {
        Self { value, gradient: [0.0; 3], hessian: [[0.0; 3]; 3] }
    }

    /// The coordinates of a point, as jets.
    pub fn coordinates(x: [f64; 3]) -> [Self; 3] {
        std::array::from_fn(|axis| {
            let mut jet = Self::constant(x[axis]);
            jet.gradient[axis] = 1.0;
            jet
        })
    }

    /// Applies f, given by its value, first and second derivative at `self.value`.
    fn through(self, [value, first, second]: [f64; 3]) -> Self {
        let g = self.gradient;
        Self {
            value,
            gradient: g.map(|a| first * a),
            hessian: std::array::from_fn(|i| {
                std::array::from_fn(|j| first * self.hessian[i][j] + second * g[i] * g[j])
            }),
        }
    }

    pub fn squared(self) -> Self {
        self * self
    }

    pub fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.through([root, 0.5 / root, -0.25 / (root * self.value)])
    }

    pub fn sin(self) -> Self {
        let (sine, cosine) = self.value.sin_cos();
        self.through([sine, cosine, -sine])
    }

    pub fn tanh(self) -> Self {
        let tanh = self.value.tanh();
        let slope = 1.0 - tanh * tanh;
        self.through([tanh, slope, -2.0 * tanh * slope])
    }

    pub fn exp(self) -> Self {
        self.through([self.value.exp(); 3])
    }
}

impl Add for Jet {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            gradient: std::array::from_fn(|i| self.gradient[i] + other.gradient[i]),
            hessian: std::array::from_fn(|i| {
                std::array::from_fn(|j| self.hessian[i][j] + other.hessian[i][j])
            }),
        }
    }
}

impl Sub for Jet {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -1.0 * other
    }
}

impl Mul for Jet {
    type Output = Self;

    #[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule has sums")]
    fn mul(self, other: Self) -> Self {
        let (g, h) = (self.gradient, other.gradient);
        Self {
            value: self.value * other.value,
            gradient: std::array::from_fn(|i| self.value * h[i] + other.value * g[i]),
            hessian: std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    let mixed = g[i] * h[j] + h[i] * g[j];
                    self.value * other.hessian[i][j] + other.value * self.hessian[i][j] + mixed
                })
            }),
        }
    }
}

impl Mul<Jet> for f64 {
    type Output = Jet;

    fn mul(self, other: Jet) -> Jet {
        Jet::constant(self) * other
    }
}

impl Add<f64> for Jet {
    type Output = Self;

    fn add(self, constant: f64) -> Self {
        self + Self::constant(constant)
    }
}
