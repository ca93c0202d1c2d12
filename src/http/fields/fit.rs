//! The fields that determine a fit, and the macro that gives them to a request.

use std::sync::Arc;

use serde::Deserialize;
use utoipa::ToSchema;

use super::choices::{DuplicatePolicy, MeanChoice, SolverChoice, SurfaceChoice};
use super::cloud_ref::CloudRef;
use super::kernel::Kernel;
use crate::http::wire::read::members::{present, present_object, present_unless_empty, present_word};
use crate::http::wire::read::points::Points;

/// The surface of an operator, where it comes from another cloud, kernel or alpha than the values. What is absent is as in
/// the request.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Geometry {
    /// The cloud whose level surface carries the operator.
    #[serde(default, deserialize_with = "present_object")]
    #[schema(nullable = false)]
    pub cloud: Option<CloudRef>,
    /// The kernel of its signature function.
    #[serde(default, deserialize_with = "present_object")]
    #[schema(nullable = false)]
    pub kernel: Option<Kernel>,
    /// Added to the diagonal of its Gram matrix.
    #[serde(default, deserialize_with = "present")]
    #[schema(nullable = false, minimum = 0.0)]
    pub alpha: Option<f64>,
    /// One entry per point of its cloud, instead of `alpha`. An empty list counts as absent.
    #[serde(default, deserialize_with = "present_unless_empty")]
    #[schema(nullable = false)]
    pub noise_variances: Option<Vec<f64>>,
    /// How its linear system is solved.
    #[serde(default, deserialize_with = "present_word")]
    #[schema(nullable = false)]
    pub solver: Option<SolverChoice>,
    /// Which function's level surface is meant.
    #[serde(default, deserialize_with = "present_word")]
    #[schema(nullable = false)]
    pub surface: Option<SurfaceChoice>,
}

/// A request about a cloud.
pub trait HasCloud {
    fn cloud(&self) -> &CloudRef;
}

/// The fields of a request that determine its fit, taken out of it.
#[derive(Debug, Default)]
pub struct Fit {
    pub cloud: CloudRef,
    pub kernel: Option<Kernel>,
    pub alpha: Option<f64>,
    pub noise_variances: Option<Vec<f64>>,
    pub solver: SolverChoice,
    pub duplicates: DuplicatePolicy,
    /// Values at the points of the cloud, where the fit is one of values.
    pub values: Option<Arc<Vec<f64>>>,
    /// Lists of them, where there may be many; 0 where there is one.
    pub n_lists: usize,
    pub mean: Option<MeanChoice>,
    /// Where local regressions learn, where the client says so.
    pub sites: Option<Points>,
}

/// Declares a request: the fields of a fit, which stand directly in it, and its own.
macro_rules! request {
    (
        $(#[$meta:meta])*
        pub struct $name:ident { $($(#[$field_meta:meta])* pub $field:ident: $type:ty,)* }
    ) => {
        $(#[$meta])*
        #[derive(Debug, serde::Deserialize, utoipa::ToSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// The points where values are known, or that sample the surface.
            #[serde(deserialize_with = "crate::http::wire::read::members::object")]
            pub cloud: $crate::http::fields::CloudRef,
            /// The kernel. Absent, it is chosen: for a surface from the cloud, for values by their likelihood, with its variance and, unless
            /// they are given, the noise and a constant mean. The diagnostics repeat all of it.
            #[serde(default, deserialize_with = "crate::http::wire::read::members::present_object")]
            #[schema(nullable = false)]
            pub kernel: Option<$crate::http::fields::Kernel>,
            /// Added to the diagonal of the Gram matrix as given, unit of the values squared: 0 interpolates, the variance
            /// of the noise regresses. Absent: 1e-10 with a kernel given; without one, the noise of the values by their likelihood, or
            /// chosen by the noise of the points of a surface, 1e-3 at least.
            #[serde(default, deserialize_with = "crate::http::wire::read::members::present")]
            #[schema(nullable = false, minimum = 0.0)]
            pub alpha: Option<f64>,
            /// The variance of the noise at each point, instead of `alpha`. An empty list counts as absent.
            #[serde(default, deserialize_with = "crate::http::wire::read::members::present_unless_empty")]
            #[schema(nullable = false)]
            pub noise_variances: Option<Vec<f64>>,
            /// How the linear system is solved.
            #[serde(default, deserialize_with = "crate::http::wire::read::members::present_word")]
            #[schema(nullable = false)]
            pub solver: Option<$crate::http::fields::SolverChoice>,
            /// What to do with points that coincide when alpha is 0.
            #[serde(default, deserialize_with = "crate::http::wire::read::members::present_word")]
            #[schema(nullable = false)]
            pub duplicates: Option<$crate::http::fields::DuplicatePolicy>,
            $($(#[$field_meta])* pub $field: $type,)*
        }

        impl $crate::http::fields::HasCloud for $name {
            fn cloud(&self) -> &$crate::http::fields::CloudRef {
                &self.cloud
            }
        }

        impl $name {
            /// Takes the fields of the fit out.
            fn take_fit(&mut self) -> $crate::http::fields::Fit {
                $crate::http::fields::Fit {
                    cloud: std::mem::take(&mut self.cloud),
                    kernel: self.kernel.take(),
                    alpha: self.alpha,
                    noise_variances: self.noise_variances.take(),
                    solver: self.solver.unwrap_or_default(),
                    duplicates: self.duplicates.unwrap_or_default(),
                    values: None,
                    n_lists: 0,
                    mean: None,
                    sites: None,
                }
            }
        }
    };
}
pub(crate) use request;
