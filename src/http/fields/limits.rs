//! Limits of the lists of a request.

use crate::config::Config;
use gramian_host::problem::Problem;
use gramian_host::wire::read::limits::{List, ListRule, Lists, ParseContext, too_many};
use gramian_host::wire::read::points::VALUE_LISTS;
use gramian_numerics::patches::MAX_SITES;
use gramian_observer::Unobserved;

/// Most probabilities for which quantiles of a posterior may be requested: more than any plot of a
/// distribution shows.
const MAX_QUANTILES: usize = 1000;

/// Sizes that requests may have.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Points of a cloud, and so entries of its normals, values and variances.
    pub max_points: usize,
    pub max_queries: usize,
    /// Coordinates per point.
    pub max_dimension: usize,
}

impl Limits {
    /// The limits of the configuration.
    pub fn of(config: &Config) -> Self {
        let &Config { max_points, max_queries, max_dimension, .. } = config;
        Self { max_points, max_queries, max_dimension }
    }

    /// No limits, for trusted bodies.
    pub const NONE: Self =
        Self { max_points: usize::MAX, max_queries: usize::MAX, max_dimension: usize::MAX };

    /// The lists of requests within these limits.
    pub fn lists(self) -> Lists {
        let Self { max_points, max_queries, max_dimension } = self;
        let (other, numbers) = (List::OTHER, List(2));
        let rule = |names, entries, most, what, remedy| ListRule {
            names,
            of_type: None,
            entries,
            most,
            what,
            remedy,
        };
        let of_values = rule(&[], numbers, max_points, "lists of values", SPLIT_LISTS);
        let kinds = [
            // Numbers, one per point.
            rule(&["values", "noise_variances"], other, max_points, "entries", ONE_PER_POINT),
            rule(&["points", "normals"], List::ROW, max_points, "points", THIN),
            rule(&["queries"], List::ROW, max_queries, "queries", SPLIT_QUERIES),
            rule(&["sites"], List::ROW, MAX_SITES, "sites", FEWER_SITES),
            rule(&["quantiles"], other, MAX_QUANTILES, "quantiles", FEWER_QUANTILES),
            rule(&["length_scales", "max", "min"], other, max_dimension, "entries", ONE_PER_COORDINATE),
            ListRule { of_type: Some(VALUE_LISTS), ..of_values },
        ];
        let n_rows = max_points.saturating_add(max_queries);
        // Points and normals in three dimensions.
        let (in_ply, elsewhere) =
            (max_points.saturating_mul(6), n_rows.saturating_mul(4).saturating_mul(max_dimension));
        Lists::new(max_dimension, too_many_coordinates, kinds).with_numbers(in_ply, elsewhere)
    }
}

/// Parses with the given lists, and without an observer.
pub fn unobserved(lists: &Lists) -> ParseContext<'_> {
    ParseContext { lists, renamed: &[], observer: &Unobserved }
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
const FEWER_SITES: &str =
    "send a sample of them, spread over the surface: more would not change the estimates";
const THIN: &str =
    "thin the cloud, or cut it into overlapping parts (operators raise the limit by GRAMIAN_MAX_POINTS)";
const COST_OF_DENSE: &str =
    "it takes 4 n² bytes and n³/3 flops (operators raise the limit by GRAMIAN_MAX_DENSE_POINTS)";
const PROJECT: &str =
    "project the points to fewer dimensions (operators raise the limit by GRAMIAN_MAX_DIMENSION)";

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
        let known = Limits::NONE.lists();
        for (name, depth) in found {
            // The rows of a batch of values are recognized by their type, because single value lists have the
            // same name.
            let list = match (name, depth) {
                ("values", 2) => known.of_type(VALUE_LISTS),
                _ => Some(known.named(name)).filter(|list| *list != List::OTHER),
            };
            let entries = list.map(|list| known.of_entries(list));
            let is_row = entries.is_some_and(|entries| entries != List::OTHER);
            assert!(list.is_some() && is_row == (depth == 2), "{name}");
        }
    }
}
