//! What a command tells about an answer: warnings, then a line of success.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use super::words::{counted, with_options};
use super::write::Answer;

/// Reasons of flags in words. They replace the warnings of the service that count the same points.
const FLAGS: [(&str, &str); 7] = [
    ("vanishing_gradient", "there is no answer, because the points do not determine the surface there"),
    ("unaffordable_rescue", "there is no answer, because one would cost too much; give --solver local"),
    ("under_resolved", "the points around them do not confirm the answer"),
    ("ambiguous_side", "the side of the normal is uncertain"),
    ("edge", "two sheets of the surface meet there at a sharp edge"),
    ("kernel_too_rough", "the kernel is too rough for curvatures; give a smoother --kernel"),
    ("far_from_cloud", "they are farther from the cloud than three spacings"),
];

/// Warnings of the service about points that have flags.
const OF_FLAGS: [&str; 4] =
    ["kernel_too_rough", "disagrees_with_neighbours", "far_from_cloud", "sharp_edges"];

/// The line of success: what there is, how much of it is flagged, and where it was written.
pub fn success(answer: &Answer, place: &str) -> String {
    let entries = |member: &str| answer.others[member].as_array().map(Vec::as_slice).unwrap_or_default();
    if answer.is_mesh() {
        let sum = |member: &str| {
            entries("parts").iter().filter_map(|part| part[member].as_u64()).sum::<u64>() as usize
        };
        let is_curve = answer.others["diagnostics"]["dimension"] == 2;
        let cells = counted(sum("n_cells"), if is_curve { "segment" } else { "triangle" });
        let shape = match (sum("n_boundary_edges"), entries("parts").len()) {
            (0, 1) => "closed".to_owned(),
            (0, n) => format!("{}, all closed", counted(n, "part")),
            (_, 1) => "with a rim".to_owned(),
            (_, n) => format!("{}, with rims", counted(n, "part")),
        };
        return format!("{}, {cells}, {shape}, wrote {place}", counted(sum("n_vertices"), "vertex"));
    }
    let n = answer.others["diagnostics"]["n_queries"].as_u64().unwrap_or_default() as usize;
    let flagged: BTreeSet<u64> = entries("flags").iter().filter_map(|flag| flag["query"].as_u64()).collect();
    let n_flagged = match flagged.len() {
        0 => "none flagged".to_owned(),
        n_flagged => counted(n_flagged, "point").replace(" points", " flagged").replace(" point", " flagged"),
    };
    format!("{}, {n_flagged}, wrote {place}", counted(n, "point"))
}

/// The warnings of an answer: flags by their reasons, then what else the service warns of.
pub fn warnings(answer: &Answer) -> Vec<String> {
    let diagnostics = &answer.others["diagnostics"];
    let n = diagnostics["n_queries"].as_u64().unwrap_or_default() as usize;
    let mut by_reason: BTreeMap<&str, usize> = BTreeMap::new();
    for flag in answer.others["flags"].as_array().into_iter().flatten() {
        *by_reason.entry(flag["reason"].as_str().unwrap_or_default()).or_default() += 1;
    }
    let of_flags = by_reason.iter().map(|(reason, count)| {
        let words = FLAGS.iter().find(|(name, _)| name == reason).map_or(*reason, |(_, words)| words);
        format!("{} of {}: {words}", counted(*count, "").trim_end_matches([' ', 's']), counted(n, "point"))
    });
    let others = diagnostics["warnings"].as_array().into_iter().flatten();
    let others = others.filter(|warning| answer.is_mesh() || !is_of_flags(warning));
    let noun = if answer.is_mesh() { "vertices" } else { "points" };
    let others = others.map(|warning| in_points(warning["detail"].as_str().unwrap_or_default(), noun));
    of_flags.chain(others).collect()
}

fn is_of_flags(warning: &Value) -> bool {
    warning["code"].as_str().is_some_and(|code| OF_FLAGS.contains(&code))
}

/// A warning with options for members, and points or vertices for queries.
fn in_points(detail: &str, noun: &str) -> String {
    with_options(detail).replace("(queries: ", &format!("({noun}: "))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn answer(others: &Value) -> Answer {
        Answer::of(others.to_string().into()).unwrap()
    }

    #[test]
    fn points_are_counted_with_their_flags() {
        let flags = [(3, "edge"), (3, "ambiguous_side"), (7, "edge")];
        let flags: Vec<Value> =
            flags.iter().map(|(query, reason)| json!({"query": query, "reason": reason})).collect();
        let warnings_of_service = json!([
            {"code": "sharp_edges", "detail": "at a sharp edge (queries: 2 of 5000)"},
            {"code": "offset_model_used", "detail": "served by the offset model (queries: 9 of 5000)"},
        ]);
        let found = answer(&json!({
            "flags": flags, "diagnostics": {"n_queries": 5000, "dimension": 3, "warnings": warnings_of_service},
        }));
        assert_eq!(success(&found, "out.ply"), "5,000 points, 2 flagged, wrote out.ply");
        assert_eq!(
            warnings(&found),
            [
                "1 of 5,000 points: the side of the normal is uncertain",
                "2 of 5,000 points: two sheets of the surface meet there at a sharp edge",
                "served by the offset model (points: 9 of 5000)",
            ]
        );
    }

    #[test]
    fn meshes_are_counted_with_their_rims() {
        let part = json!({"n_vertices": 1200, "n_cells": 2396, "n_boundary_edges": 0});
        let mesh = |parts: &[&Value]| {
            answer(&json!({"parts": parts, "diagnostics": {"dimension": 3, "warnings": []}}))
        };
        assert_eq!(success(&mesh(&[&part]), "a.stl"), "1,200 vertices, 2,396 triangles, closed, wrote a.stl");
        assert!(success(&mesh(&[&part, &part]), "a.stl").contains("2 parts, all closed"));
        let open = json!({"n_vertices": 3, "n_cells": 1, "n_boundary_edges": 3});
        assert_eq!(success(&mesh(&[&open]), "a.stl"), "3 vertices, 1 triangle, with a rim, wrote a.stl");
    }
}
