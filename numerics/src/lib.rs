//! Geometric kernel interpolation and regression on point clouds, after Guidotti: f64 in, f64 out.
//!
//! A cloud of n points, a [`kernel::Kernel`] and a [`Regularization`] α make a [`System`], K + αI. A
//! [`Solver`] factorizes it once. Functions through values, their variances, and the surface that the points
//! sample are then solves and sums:
//!
//! ```
//! use std::sync::Arc;
//!
//! use gramian_numerics::regression::function::interpolant::Interpolant;
//! use gramian_numerics::kernel::{Family, Kernel};
//! use gramian_numerics::observer::Unobserved;
//! use gramian_numerics::points::cloud::Cloud;
//! use gramian_numerics::regression::solver::{Solver, System};
//! use gramian_numerics::regression::sums::jets::JetOrder;
//! use gramian_numerics::regression::sums::regularization::Regularization;
//! use gramian_numerics::surface::Surface;
//! use gramian_numerics::surface::geometry::{Geometry, GeometryRequest};
//!
//! // 200 points of a circle of radius 2, and the values x at them.
//! let angles = (0..200).map(|i| std::f64::consts::TAU * f64::from(i) / 200.0);
//! let points: Vec<f64> = angles.flat_map(|t| [2.0 * t.cos(), 2.0 * t.sin()]).collect();
//! let values: Vec<f64> = points.chunks(2).map(|point| point[0]).collect();
//! let cloud = Arc::new(Cloud::new(points, 2)?);
//!
//! // One factorization serves all that follows.
//! let kernel = Kernel::new(Family::Matern { order: 4 }, 2.0, 1.0)?;
//! let system = System::new(cloud.clone(), kernel, Regularization::uniform(1e-10)?)?;
//! let solver = Arc::new(Solver::dense(system, &Unobserved)?);
//!
//! // A function through the values, at a query.
//! let function = Interpolant::fit(solver.clone(), &values, &Unobserved)?;
//! let at = Cloud::new(vec![0.0, 2.0], 2)?;
//! let jets = function.at(&at, JetOrder::Gradient, &Unobserved)?;
//! assert!(jets.values()[0].abs() < 1e-6);
//!
//! // The surface is the level set of the function through the constant 1.
//! let signature = Interpolant::signature(solver, &Unobserved)?;
//! let surface = Surface::of(signature, None, &Unobserved)?;
//! let geometry = Geometry::of(&surface, &cloud, &GeometryRequest::CURVATURES, &Unobserved)?;
//! let curvatures = geometry.curvatures(&Unobserved)?;
//! assert!(curvatures.mean.iter().all(|mean| (mean - 0.5).abs() < 1e-3));
//! # Ok::<(), gramian_numerics::error::NumericsError>(())
//! ```
//!
//! Pure by rule: no JSON, HTTP, async, environment, clock or global state. Heavy loops run on the rayon pool
//! of the calling thread. An [`observer::Observer`] is told of stages, and may cancel. Errors name their
//! cause and the offending point ([`error::NumericsError`]).
//!
//! The rooms, each of which knows those before it: [`machine`], [`points`], [`kernel`], [`patches`],
//! [`regression`], [`orientation`], [`surface`], [`operators`], [`mesh`], [`model`].
//!
//! [`Regularization`]: regression::sums::regularization::Regularization
//! [`System`]: regression::solver::System
//! [`Solver`]: regression::solver::Solver

// A request must never bring a thread down; tests may.
#![cfg_attr(test, allow(clippy::disallowed_methods))]
#![cfg_attr(not(test), warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable))]

// The clouds of all tests name this crate as they do.
#[cfg(test)]
extern crate self as gramian_numerics;

pub mod error;
pub mod observer;

pub mod machine;
pub mod points;

pub mod kernel;

pub mod patches;

pub mod regression;

pub mod orientation;

pub mod surface;

pub mod operators;

pub mod mesh;

pub mod model;

#[cfg(test)]
pub(crate) mod testing;
