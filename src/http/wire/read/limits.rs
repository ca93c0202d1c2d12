//! Limits of a request that are enforced while it is parsed.
//!
//! Parsing stops where a list is longer than any request may have. So no body takes more memory than requests
//! within the limits need.

use crate::config::Config;
use crate::http::problem::Problem;
use crate::http::problem::slug::Slug;
use gramian_numerics::observer::{Observer, Unobserved};
use gramian_numerics::patches::MAX_SITES;

/// Type name that marks a field as lists of values, whatever the name of its member.
pub(super) const VALUE_LISTS: &str = "ValueLists";

/// Most probabilities for which quantiles of a posterior may be requested: more than any plot of a
/// distribution shows.
const MAX_QUANTILES: usize = 1000;

/// Limits and observer of one parse.
#[derive(Clone, Copy)]
pub struct ParseContext<'a> {
    /// Points of a cloud, and so entries of its normals, values and variances.
    pub max_points: usize,
    pub max_queries: usize,
    /// Coordinates per point.
    pub max_dimension: usize,
    /// Tells when the request is cancelled because nobody waits for it.
    pub observer: &'a dyn Observer,
}

impl<'a> ParseContext<'a> {
    /// The limits of the configuration, for a request watched by `observer`.
    pub fn new(config: &Config, observer: &'a dyn Observer) -> Self {
        let &Config { max_points, max_queries, max_dimension, .. } = config;
        Self { max_points, max_queries, max_dimension, observer }
    }

    /// No limits and no observer, for trusted bodies.
    pub const UNLIMITED: ParseContext<'static> = ParseContext {
        max_points: usize::MAX,
        max_queries: usize::MAX,
        max_dimension: usize::MAX,
        observer: &Unobserved,
    };

    /// Most entries that a list may have.
    pub(super) fn max_entries(&self, list: List) -> usize {
        match list {
            List::Points | List::Numbers | List::ValueLists => self.max_points,
            List::Queries => self.max_queries,
            List::Sites => MAX_SITES,
            List::Quantiles => MAX_QUANTILES,
            List::Coordinates | List::PerAxis => self.max_dimension,
            List::Other => usize::MAX,
        }
    }

    /// The 413 problem for a list that is too long.
    pub(super) fn too_large(&self, excess: Excess, pointer: &str) -> Problem {
        let Excess { list, length, width } = excess;
        let limit = self.max_entries(list);
        let problem = match (list, width) {
            (_, Some(width)) if length <= limit => too_many_coordinates(self.max_dimension, width, length),
            (List::Queries, _) => too_many_queries(limit, length),
            (List::Numbers, _) => too_many("entries", limit, length, ONE_PER_POINT),
            (List::ValueLists, _) => too_many("lists of values", limit, length, SPLIT_LISTS),
            (List::PerAxis, _) => too_many("entries", limit, length, ONE_PER_COORDINATE),
            (List::Sites, _) => too_many_sites(limit, length),
            (List::Quantiles, _) => too_many("quantiles", limit, length, FEWER_QUANTILES),
            (List::Points | List::Coordinates | List::Other, _) => too_many_points(limit, length),
        };
        problem.at(pointer)
    }
}

/// Kinds of numeric lists in a request. A test checks the names against the `OpenAPI` document.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum List {
    /// Rows of a cloud, or its normals.
    Points,
    /// Rows at which answers are wanted.
    Queries,
    /// Rows at which local regressions learn a surface.
    Sites,
    /// A list with a number per point.
    Numbers,
    /// Lists of values, each with a number per point.
    ValueLists,
    /// Probabilities at which quantiles are wanted.
    Quantiles,
    /// A list with a number per axis.
    PerAxis,
    /// The coordinates of a row.
    Coordinates,
    /// Strings, or not a list at all.
    Other,
}

impl List {
    pub(super) fn named(name: &str) -> Self {
        match name {
            "points" | "normals" => Self::Points,
            "queries" => Self::Queries,
            "sites" => Self::Sites,
            "values" | "noise_variances" => Self::Numbers,
            "quantiles" => Self::Quantiles,
            "length_scales" | "max" | "min" => Self::PerAxis,
            _ => Self::Other,
        }
    }

    /// The kind of list marked by the name of its type.
    pub(super) fn of_type(name: &str) -> Option<Self> {
        (name == VALUE_LISTS).then_some(Self::ValueLists)
    }

    /// The kind of the entries of this list.
    pub(super) fn of_entries(self) -> Self {
        match self {
            Self::Points | Self::Queries | Self::Sites => Self::Coordinates,
            Self::ValueLists => Self::Numbers,
            Self::Numbers | Self::Quantiles | Self::PerAxis | Self::Coordinates | Self::Other => Self::Other,
        }
    }
}

/// A list that is too long, or that has a row that is too long.
#[derive(Debug, Clone, Copy)]
pub(super) struct Excess {
    pub(super) list: List,
    /// Entries of the list.
    pub(super) length: usize,
    /// Entries of the first row that is too long.
    pub(super) width: Option<usize>,
}

const ONE_PER_POINT: &str =
    "send one per point of the cloud (operators raise the limit by GRAMIAN_MAX_POINTS)";
const ONE_PER_COORDINATE: &str =
    "send one per coordinate of the points (operators raise the limit by GRAMIAN_MAX_DIMENSION)";
const SPLIT_LISTS: &str = "split them over several requests: the cached factorization serves all of them \
                           (operators raise the limit by GRAMIAN_MAX_POINTS)";
const SPLIT_QUERIES: &str = "split them over several requests: the cached factorization serves all of them \
                             (operators raise the limit by GRAMIAN_MAX_QUERIES)";
const FEWER_QUANTILES: &str =
    "ask for fewer: the distributions are normal, so means and variances determine every quantile";
const THIN: &str =
    "thin the cloud, or cut it into overlapping parts (operators raise the limit by GRAMIAN_MAX_POINTS)";
const COST_OF_DENSE: &str =
    "it takes 4 n² bytes and n³/3 flops (operators raise the limit by GRAMIAN_MAX_DENSE_POINTS)";
const PROJECT: &str =
    "project the points to fewer dimensions (operators raise the limit by GRAMIAN_MAX_DIMENSION)";

/// 413 for more of something than there may be.
fn too_many(what: &str, limit: usize, required: usize, remedy: &str) -> Problem {
    Problem::too_large(Slug::ProblemTooLarge, what, limit, Some(required)).with_remedy(remedy)
}

/// 413 for a cloud with too many points.
pub fn too_many_points(limit: usize, required: usize) -> Problem {
    too_many("points", limit, required, THIN)
}

/// 413 for a cloud with too many points for a dense factorization.
pub fn too_many_dense_points(limit: usize, required: usize) -> Problem {
    too_many("points in a dense factorization", limit, required, COST_OF_DENSE)
}

/// 413 for too many queries.
pub fn too_many_queries(limit: usize, required: usize) -> Problem {
    too_many("queries", limit, required, SPLIT_QUERIES)
}

/// 413 for points with too many coordinates, with a hint if the `n_rows` rows look like columns.
pub fn too_many_coordinates(limit: usize, required: usize, n_rows: usize) -> Problem {
    let remedy = if n_rows <= limit { transposed(n_rows, required) } else { PROJECT.to_owned() };
    too_many("coordinates a point", limit, required, &remedy)
}

fn too_many_sites(limit: usize, required: usize) -> Problem {
    Problem::too_large(Slug::ProblemTooLarge, "sites", limit, Some(required))
        .with_remedy("send a sample of them, spread over the surface: more would not change the estimates")
}

/// The remedy for a client whose rows are columns.
pub fn transposed(n_rows: usize, n_columns: usize) -> String {
    let rows = if n_rows == 1 { "row" } else { "rows" };
    format!("rows are points: {n_rows} {rows} of {n_columns} coordinates; transpose the array")
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use serde_json::Value;

    use super::*;

    /// Collects the names and depths of all members that are lists of numbers, in a schema and all schemas it
    /// refers to.
    fn lists<'a>(document: &'a Value, schema: &'a Value, found: &mut BTreeSet<(&'a str, usize)>) {
        if let Some(reference) = schema["$ref"].as_str() {
            let schema = document.pointer(&reference[1..]).unwrap();
            return lists(document, schema, found);
        }
        for (name, member) in schema["properties"].as_object().into_iter().flatten() {
            let (mut inner, mut depth) = (member, 0);
            while inner["type"] == "array" {
                (inner, depth) = (&inner["items"], depth + 1);
            }
            if inner["type"] == "number" && depth > 0 {
                found.insert((name, depth));
            }
            lists(document, member, found);
        }
        for part in schema["oneOf"].as_array().into_iter().chain(schema["allOf"].as_array()).flatten() {
            lists(document, part, found);
        }
    }

    #[test]
    fn every_list_of_numbers_of_a_request_has_a_limit() {
        let document: Value = serde_json::from_str(&crate::http::openapi_json()).unwrap();
        let mut found = BTreeSet::new();
        for path in document["paths"].as_object().unwrap().values() {
            lists(
                &document,
                &path["post"]["requestBody"]["content"]["application/json"]["schema"],
                &mut found,
            );
        }
        let names: Vec<&str> = found.iter().map(|(name, _)| *name).collect();
        assert_eq!(
            names,
            [
                "length_scales",
                "max",
                "min",
                "noise_variances",
                "normals",
                "points",
                "quantiles",
                "queries",
                "sites",
                "values",
                "values"
            ]
        );
        for (name, depth) in found {
            // The rows of a batch of values are recognized by their type, because single value lists have the
            // same name.
            let list = match (name, depth) {
                ("values", 2) => List::of_type(VALUE_LISTS),
                _ => Some(List::named(name)).filter(|list| *list != List::Other),
            };
            let entries = list.map(List::of_entries);
            let is_row = entries.is_some_and(|entries| entries != List::Other);
            assert!(list.is_some() && is_row == (depth == 2), "{name}");
        }
    }
}
