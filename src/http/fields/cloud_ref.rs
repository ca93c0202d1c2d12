//! The cloud of a request.

use serde::Deserialize;
use utoipa::ToSchema;

use super::schemas::CloudIdSchema;
use crate::http::wire::read::members::{present, present_unless_empty};
use crate::http::wire::read::points::Points;

/// A cloud: the id of a registered one, or its points. Exactly one of `id` and `points` is given.
#[derive(Debug, Default, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CloudRef {
    /// The id of a registered cloud, 64 hexadecimal digits.
    #[serde(default, deserialize_with = "present")]
    #[schema(nullable = false, value_type = Option<CloudIdSchema>)]
    pub id: Option<String>,
    /// The points, one row of coordinates each, all of the same length; the cloud is registered with them.
    #[serde(default, deserialize_with = "present")]
    #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>, min_items = 1)]
    pub points: Option<Points>,
    /// Normals at the points, one row each, of any length but 0, with `points` only. Their side is outward. An empty list
    /// counts as absent.
    #[serde(default, deserialize_with = "present_unless_empty")]
    #[schema(nullable = false, value_type = Option<Vec<Vec<f64>>>)]
    pub normals: Option<Points>,
}
