//! The cloud of a request, by id or by points.

use std::sync::Arc;

use serde::Deserialize;
use utoipa::ToSchema;

use super::schemas::CloudIdSchema;
use crate::store::clouds::RegisteredCloud;
use gramian_host::wire::read::members::present_unless_empty;
use gramian_host::wire::read::points::Points;

/// A cloud, given by the id of a registered cloud or by its points. Exactly one of `id` and `points` is
/// given.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CloudInput {
    /// The id of a registered cloud, 64 hexadecimal digits.
    #[schema(value_type = Option<CloudIdSchema>)]
    pub id: Option<String>,
    /// The points, with a row of coordinates each, all of the same length. The cloud is registered with the
    /// request.
    #[schema(value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
    pub points: Option<Points>,
    /// Normals at the points, a row each, of any length but 0, with `points` only. They point to the outward
    /// side. An empty list counts as absent.
    #[serde(default, deserialize_with = "present_unless_empty")]
    #[schema(value_type = Option<Vec<Vec<f64>>>)]
    pub normals: Option<Points>,
    /// The cloud, once the points of the request are registered.
    #[serde(skip)]
    #[schema(ignore)]
    pub registered: Option<Arc<RegisteredCloud>>,
}
