//! The fields that determine a fit, and the macro that adds them to a request.

use serde::Deserialize;
use utoipa::ToSchema;

use super::choices::{DuplicatePolicy, MeanChoice, SolverChoice, SurfaceModelChoice};
use super::cloud_input::CloudInput;
use super::hyperparameters::Hyperparameters;
use super::kernel::Kernel;
use gramian_host::wire::read::members::present_unless_empty;
use gramian_host::wire::read::points::Points;

/// The surface of an operator, if it differs from the surface of the request.
///
/// It may come from another cloud, kernel or alpha than the values. Absent fields are taken from the request.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Surface {
    /// The cloud whose level surface carries the operator.
    pub cloud: Option<CloudInput>,
    /// The kernel of the signature function of the surface.
    pub kernel: Option<Kernel>,
    /// Added to the diagonal of the Gram matrix of the surface.
    #[schema(minimum = 0.0)]
    pub alpha: Option<f64>,
    /// Noise variances of the surface, an entry per point of its cloud, instead of `alpha`. An empty list
    /// counts as absent.
    #[serde(default, deserialize_with = "present_unless_empty")]
    pub noise_variances: Option<Vec<f64>>,
    /// The method that solves the linear system of the surface.
    pub solver: Option<SolverChoice>,
    /// The function whose level set is the surface.
    pub model: Option<SurfaceModelChoice>,
}

/// A request about a cloud.
pub trait HasCloud {
    fn cloud(&self) -> &CloudInput;

    fn cloud_mut(&mut self) -> &mut CloudInput;

    /// The kernel of the request, its noise, and its solver.
    fn process(&self) -> GivenProcess<'_>;

    /// Whether points that coincide may be merged.
    fn may_merge(&self) -> bool;

    /// The cloud of the surface, where it may differ from that of the values.
    fn surface_cloud(&self) -> Option<&CloudInput> {
        None
    }
}

/// Kernel, noise and solver of a request, as far as they are given.
#[derive(Debug, Clone, Copy)]
pub struct GivenProcess<'a> {
    pub kernel: Option<&'a Kernel>,
    pub alpha: Option<f64>,
    pub noise_variances: Option<&'a Vec<f64>>,
    pub solver: SolverChoice,
}

/// The fields that determine a fit, moved out of a request.
#[derive(Debug, Default)]
pub struct Fit {
    pub cloud: CloudInput,
    pub kernel: Option<Kernel>,
    pub alpha: Option<f64>,
    pub noise_variances: Option<Vec<f64>>,
    pub solver: SolverChoice,
    pub tolerance: Option<f64>,
    pub duplicates: DuplicatePolicy,
    pub mean: Option<MeanChoice>,
    /// Sites at which local regressions learn, if the client gives them.
    pub sites: Option<Points>,
    /// What local regressions learned before, if the client gives it.
    pub hyperparameters: Option<Hyperparameters>,
}

/// Declares a request. The fields of a fit and the request's own fields are members of the same object.
///
/// `with` names the field that holds the [`Surface`] of the surface, where the request has one. `taking`
/// adds the hyperparameters of a surface.
macro_rules! request {
    (
        $(#[$meta:meta])*
        pub struct $name:ident $(with $surface:ident)? $(taking $hyperparameters:ident)? {
            $($(#[$field_meta:meta])* pub $field:ident: $type:ty,)*
        }
    ) => {
        $(#[$meta])*
        #[derive(Debug, serde::Deserialize, utoipa::ToSchema)]
        #[serde(deny_unknown_fields)]
        pub struct $name {
            /// The points at which values are known, or that sample the surface.
            pub cloud: $crate::http::fields::CloudInput,
            /// The kernel. If absent, it is chosen.
            ///
            /// A surface's kernel is chosen from the cloud. A kernel for values is chosen by their
            /// likelihood, together with its variance and, unless they are given, the noise and a constant
            /// mean. The diagnostics repeat all of it.
            pub kernel: Option<$crate::http::fields::Kernel>,
            /// Added to the diagonal of the Gram matrix as given, unit of the values squared.
            ///
            /// 0 interpolates, and the variance of the noise regresses. Default: 1e-10 if a kernel is given.
            /// Without a kernel, alpha is chosen. For values it is their noise by the likelihood. For
            /// surfaces it follows the noise of the points and is at least 1e-3.
            #[schema(minimum = 0.0)]
            pub alpha: Option<f64>,
            /// The variance of the noise at each point, instead of `alpha`. An empty list counts as absent.
            #[serde(default, deserialize_with = "gramian_host::wire::read::members::present_unless_empty")]
            pub noise_variances: Option<Vec<f64>>,
            /// The method that solves the linear system.
            pub solver: Option<$crate::http::fields::SolverChoice>,
            /// The largest relative residual of an answer of the solver `iterative`. Default: 1e-8.
            /// Beyond the dense limit, `auto` takes that solver for values if this field is given and few
            /// landmarks are not enough.
            #[schema(minimum = 1e-14, maximum = 1e-5)]
            pub tolerance: Option<f64>,
            /// The treatment of points that coincide when alpha is 0.
            pub duplicates: Option<$crate::http::fields::DuplicatePolicy>,
            $($(#[$field_meta])* pub $field: $type,)*
            $(
                /// What local regressions take instead of learning it: the hyperparameters of an answer
                /// about a cloud that has the points of this surface.
                pub $hyperparameters: Option<$crate::http::fields::Hyperparameters>,
            )?
        }

        impl $crate::http::fields::HasCloud for $name {
            fn cloud(&self) -> &$crate::http::fields::CloudInput {
                &self.cloud
            }

            fn cloud_mut(&mut self) -> &mut $crate::http::fields::CloudInput {
                &mut self.cloud
            }

            fn may_merge(&self) -> bool {
                self.duplicates == Some($crate::http::fields::DuplicatePolicy::Merge)
            }

            fn process(&self) -> $crate::http::fields::GivenProcess<'_> {
                $crate::http::fields::GivenProcess {
                    kernel: self.kernel.as_ref(),
                    alpha: self.alpha,
                    noise_variances: self.noise_variances.as_ref(),
                    solver: self.solver.unwrap_or_default(),
                }
            }

            $(fn surface_cloud(&self) -> Option<&$crate::http::fields::CloudInput> {
                self.$surface.as_ref()?.cloud.as_ref()
            })?
        }

        impl $name {
            /// Moves the fields of the fit out of the request.
            fn take_fit(&mut self) -> $crate::http::fields::Fit {
                $crate::http::fields::Fit {
                    cloud: std::mem::take(&mut self.cloud),
                    kernel: self.kernel.take(),
                    alpha: self.alpha,
                    noise_variances: self.noise_variances.take(),
                    solver: self.solver.unwrap_or_default(),
                    tolerance: self.tolerance,
                    duplicates: self.duplicates.unwrap_or_default(),
                    mean: None,
                    sites: None,
                    hyperparameters: None$(.or(self.$hyperparameters.take()))?,
                }
            }
        }
    };
}
pub(crate) use request;
