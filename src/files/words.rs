//! What the service tells clients of HTTP, in the words of files, points and options.
//!
//! The service names members of a request. A command line has options for some of them, and `--with` for all
//! others.

use serde_json::Value;

use super::write;

/// Members that have an option of the same meaning.
const OPTIONS: [(&str, &str); 6] = [
    ("alpha", "--alpha"),
    ("duplicates", "--duplicates"),
    ("kernel", "--kernel"),
    ("open", "--open"),
    ("solver", "--solver"),
    ("step", "--step"),
];

/// Phrases of remedies and warnings, and what they are with options. Longer phrases stand before their parts.
const PHRASES: [(&str, &str); 33] = [
    (
        "set alpha (or their noise_variances) above 0, or alpha to 0 and \"duplicates\" to \"merge\" to average their \
         values",
        "give --duplicates merge to count them once, or --alpha above 0",
    ),
    ("ask for the surface local, let it be open if it ends with its points, or set bounds", SURFACE_REMEDY),
    (
        "ask for the surface local, or for a longer length scale",
        "give --solver local, or a longer length in --kernel",
    ),
    (
        "let the surface be open if it ends with its points, or give them normals outward",
        "give --open if the surface ends with its points, or normals outward in the file",
    ),
    ("make it longer, or set bounds", "give a longer --step, or bounds by --with"),
    (
        "use laplace with epsilon > 0 or matern with nu of 1.5 or more",
        "give --kernel matern or laplace,epsilon=0.01",
    ),
    ("use matern with nu of 2.5 or more", "give --kernel matern,nu=2.5 or more"),
    ("or take the surface model offset", "or give --surface offset"),
    ("leave this out, or take the surface model \"signature\"", "leave it out, or give --surface signature"),
    ("or use a rougher kernel", "or a rougher --kernel"),
    ("take a rougher kernel or a shorter length scale", "a rougher --kernel or a shorter length in it"),
    ("take a smoother kernel or a longer length scale", "give a smoother --kernel or a longer length in it"),
    ("set a larger tolerance or alpha", "give a larger --alpha, or tolerance by --with"),
    ("set a larger alpha", "give a larger --alpha"),
    ("set \"solver\": \"dense\"", "give --solver dense"),
    ("set \"solver\": \"local\"", "give --solver local"),
    ("set \"solver\" to", "give --solver"),
    ("set alpha to", "give --alpha"),
    ("take a smoother kernel", "give a smoother --kernel"),
    ("choose another family", "give another family by --kernel"),
    (
        "raise epsilon until sqrt(epsilon)·length_scale is twice the spacing",
        "give a smoother --kernel, such as matern",
    ),
    ("leave surface_model out", "leave --surface out"),
    (
        "split the queries over several requests, or ask for fewer members: the cached factorization serves all of them",
        "give a longer --step, or thin the cloud",
    ),
    ("; include edge_normals for the normals of both", ""),
    ("; parts has their numbers", ""),
    ("; support says which", ""),
    ("; see flags", ""),
    ("query elsewhere, ", ""),
    ("unknown variant", "unknown word"),
    ("unknown field", "unknown member"),
    ("this request has", "these are"),
    ("the request ", "the command "),
    ("\"iterative\", \"dense\" or \"local\"", "iterative, dense or local"),
];

const SURFACE_REMEDY: &str = "give --open if the surface ends with its points, or bounds by --with";

/// The sentence of a problem with a cloud, led by the option that it is about, if it is about one.
pub fn of_cloud_problem(problem: &Value) -> String {
    let pointer = problem["errors"][0]["pointer"].as_str().unwrap_or_default();
    let detail = with_options(problem["detail"].as_str().unwrap_or_default());
    let listed = points_in_question(problem);
    match option_of(pointer) {
        Some(option) if !detail.contains(option) => format!("{option}: {detail}{listed}"),
        _ => format!("{detail}{listed}"),
    }
}

/// The sentence of a problem with a request in a file, with the place in it.
pub fn of_request_problem(problem: &Value) -> String {
    let detail = write::as_endings(problem["detail"].as_str().unwrap_or_default());
    let detail = detail.replace("add one of them to Accept", "let the name of the file end so");
    let place = problem["errors"][0]["pointer"].as_str().unwrap_or_default();
    let place = place.trim_start_matches('/').replace('/', ".");
    match place.as_str() {
        "" if problem["type"] == "/problems/malformed-json" => format!("the file is not JSON: {detail}"),
        "" => detail,
        place => format!("{place}: {detail}"),
    }
}

/// A text of the service in words of options.
pub fn with_options(text: &str) -> String {
    let words = |text: String, (phrase, words): &(&str, &str)| text.replace(phrase, words);
    let mut text = PHRASES.iter().fold(with_points(text), words);
    while let Some((before, rest)) = text.split_once("(operators raise the limit by GRAMIAN_") {
        let (name, after) = rest.split_once(')').unwrap_or((rest, ""));
        let option = name.to_lowercase().replace('_', "-");
        text = format!("{before}(--{option} raises the limit){after}");
    }
    text
}

/// Members that no option led to: the cloud, and the surface that the service chose.
const OF_CLOUDS: [&str; 5] = ["", "cloud", "points", "queries", "surface_model"];

/// A text with points, counted from 1 as files count them, instead of queries, counted from 0.
fn with_points(text: &str) -> String {
    let mut pieces = text.split(QUERY);
    let mut out = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let n_digits = piece.bytes().take_while(u8::is_ascii_digit).count();
        let (number, rest) = piece.split_at(n_digits);
        match number.parse::<usize>() {
            Ok(query) => {
                let same = format!(", which is point {query} of the cloud");
                out += &format!("point {}{}", query + 1, rest.strip_prefix(&same).unwrap_or(rest));
            }
            Err(_) => out += &format!("{QUERY}{piece}"),
        }
    }
    out
}

const QUERY: &str = "query ";

/// The option for a member of a request, or `--with`. `None` if the problem is the cloud's.
fn option_of(pointer: &str) -> Option<&'static str> {
    let member = pointer.split('/').nth(1).filter(|member| !OF_CLOUDS.contains(member))?;
    let option = OPTIONS.iter().find(|(name, _)| *name == member);
    Some(option.map_or("--with", |(_, option)| option))
}

/// Points in question, counted from 1, as files count them.
const MAX_LISTED: usize = 5;

fn points_in_question(problem: &Value) -> String {
    let Some(points) = problem["point_indices"].as_array().filter(|points| !points.is_empty()) else {
        return String::new();
    };
    let listed: Vec<String> =
        points.iter().take(MAX_LISTED).filter_map(|at| Some((at.as_u64()? + 1).to_string())).collect();
    let more = if points.len() > MAX_LISTED { ", …" } else { "" };
    let noun = if points.len() == 1 { "point" } else { "points" };
    format!(" ({noun} {}{more})", listed.join(", "))
}

/// A number of things in words: "5,000 points".
pub fn counted(n: usize, singular: &str) -> String {
    let digits = n.to_string();
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().filter_map(|group| std::str::from_utf8(group).ok()).collect();
    let plural = match singular.strip_suffix("ex") {
        _ if n == 1 => singular.to_owned(),
        Some(stem) => format!("{stem}ices"),
        None => format!("{singular}s"),
    };
    format!("{} {plural}", groups.join(","))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn remedies_name_options_and_points_of_files() {
        let told = |pointer: &str, detail: &str, points: &[usize]| {
            let problem =
                json!({"detail": detail, "errors": [{"pointer": pointer}], "point_indices": points});
            of_cloud_problem(&problem)
        };
        let text = told("/alpha", "alpha must be between 0 and 1e300", &[]);
        assert_eq!(text, "--alpha: alpha must be between 0 and 1e300");
        let detail = "K + alpha I is not positive definite in float64: Cholesky fails; set alpha to 1.8e-10 or more, or \
                      use a rougher kernel";
        let text = told("/alpha", detail, &[16]);
        assert!(text.ends_with("give --alpha 1.8e-10 or more, or a rougher --kernel (point 17)"), "{text}");
        let detail = "at most 5 points are served, this request has 600; thin the cloud, or cut it into overlapping \
                      parts (operators raise the limit by GRAMIAN_MAX_POINTS)";
        let text = told("/points", detail, &[]);
        assert!(
            text.contains("these are 600") && text.ends_with("(--max-points raises the limit)"),
            "{text}"
        );
        assert_eq!(told("/nonsense", "unknown field", &[]), "--with: unknown member");
        let detail = "no gradient at query 16, which is point 16 of the cloud; query elsewhere, or take the surface model offset";
        assert_eq!(told("/queries", detail, &[]), "no gradient at point 17; or give --surface offset");
    }

    #[test]
    fn numbers_are_counted_in_groups_of_three_digits() {
        assert_eq!(counted(1, "point"), "1 point");
        assert_eq!(counted(5000, "point"), "5,000 points");
        assert_eq!(counted(1_234_567, "vertex"), "1,234,567 vertices");
    }
}
