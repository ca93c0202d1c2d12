//! Content negotiation: the media type and content coding of a request body and of its answer.

use axum::http::{HeaderMap, HeaderName, header};

use crate::problem::Problem;
use crate::problem::catalogue;

/// Media type of a request body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BodyFormat {
    Json,
    /// Tensors named like the arrays of the JSON. Everything else is JSON text in the metadata.
    Safetensors,
    /// A single `NumPy` array.
    Npy,
    /// Points in the format of scanners, with normals if there are any.
    Ply,
}

impl BodyFormat {
    pub const fn media_type(self) -> &'static str {
        match self {
            Self::Json => Format::Json.media_type(),
            Self::Safetensors => Format::Safetensors.media_type(),
            Self::Npy => Format::Npy.media_type(),
            Self::Ply => Format::Ply.media_type(),
        }
    }
}

/// Media type of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    Json,
    /// Tensors named like the arrays of the JSON. Everything else is JSON text in the metadata.
    Safetensors,
    /// A single `NumPy` array.
    Npy,
    /// Points or a mesh, with quantities as properties.
    Ply,
    /// Points or a mesh as binary glTF.
    Gltf,
    /// A mesh as Wavefront OBJ, text.
    Obj,
}

impl Format {
    pub const fn media_type(self) -> &'static str {
        match self {
            Self::Json => "application/json",
            Self::Safetensors => "application/x-safetensors",
            Self::Npy => "application/x-npy",
            Self::Ply => "model/ply",
            Self::Gltf => "model/gltf-binary",
            Self::Obj => "model/obj",
        }
    }
}

/// Content coding of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coding {
    Identity,
    Gzip,
    Zstd,
}

impl Coding {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Identity => "identity",
            Self::Gzip => "gzip",
            Self::Zstd => "zstd",
        }
    }
}

/// Format and coding of the answer, negotiated from the request headers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AnswerEncoding {
    pub format: Format,
    pub coding: Coding,
}

impl AnswerEncoding {
    /// Chooses among the formats that are offered, which are ordered by the server's preference.
    ///
    /// # Errors
    /// 406 `not-acceptable` if the client accepts none of them.
    pub fn of(headers: &HeaderMap, offered: &[Format]) -> Result<Self, Problem> {
        let format = accepted_format(headers, offered)?;
        Ok(Self { format, coding: accepted_coding(headers, format) })
    }
}

/// Chooses the coding of a text from `Accept-Encoding`.
pub fn accepted_text_coding(headers: &HeaderMap) -> Coding {
    accepted_coding(headers, Format::Json)
}

/// Chooses the format of the answer from `Accept` (RFC 9110, section 12.5.1).
///
/// The most specific range that matches a format gives its weight. The greatest weight wins. On a tie, the
/// format whose range is more specific wins, then the first one offered.
fn accepted_format(headers: &HeaderMap, offered: &[Format]) -> Result<Format, Problem> {
    let Some(accept) = list_of(headers, &header::ACCEPT) else {
        return offered.first().copied().ok_or_else(Problem::internal);
    };
    let mut best = None;
    for &format in offered {
        let specificity = |range: &str| match range {
            name if name == format.media_type() => Some(2),
            "application/*" if format.media_type().starts_with("application/") => Some(1),
            "model/*" if format.media_type().starts_with("model/") => Some(1),
            "*/*" => Some(0),
            _ => None,
        };
        let matching = weights(&accept).filter_map(|(range, weight)| Some((specificity(&range)?, weight)));
        let Some((specificity, weight)) = matching.max_by_key(|&(specificity, _)| specificity) else {
            continue;
        };
        let rank = (weight, specificity);
        if weight > 0.0 && best.is_none_or(|(_, least)| rank > least) {
            best = Some((format, rank));
        }
    }
    best.map(|(format, _)| format).ok_or_else(|| {
        let detail = format!(
            "answers come as {}; add one of them to Accept",
            names(offered.iter().map(|format| format.media_type()))
        );
        Problem::new(catalogue::NOT_ACCEPTABLE, detail)
    })
}

/// Chooses the coding of the answer from `Accept-Encoding` (RFC 9110, section 12.5.3).
///
/// zstd wins over gzip of equal weight. If no coding is acceptable, the answer is not compressed. Binary
/// formats stay uncompressed unless the client prefers compression: it takes long and saves only a few per
/// cent of binary numbers.
fn accepted_coding(headers: &HeaderMap, format: Format) -> Coding {
    let Some(accept) = list_of(headers, &header::ACCEPT_ENCODING) else { return Coding::Identity };
    let given = |name: &str| weights(&accept).filter(|(coding, _)| coding == name).last();
    let weight = |name: &str| given(name).or_else(|| given("*")).map_or(0.0, |(_, weight)| weight);
    let identity = match (given("identity"), given("*"), format) {
        (Some((_, weight)), ..) => weight,
        (None, Some((_, 0.0)), _) => 0.0,
        (None, _, Format::Json | Format::Obj) => f64::MIN_POSITIVE,
        (None, _, Format::Safetensors | Format::Npy | Format::Ply | Format::Gltf) => 1.0,
    };
    let codings = [(Coding::Zstd, weight("zstd")), (Coding::Gzip, weight("gzip"))];
    let first =
        if matches!(format, Format::Json | Format::Obj) { None } else { Some((Coding::Identity, identity)) };
    let ranked = first.into_iter().chain(codings).chain([(Coding::Identity, identity)]);
    let best = ranked.filter(|(_, weight)| *weight > 0.0).reduce(|a, b| if b.1 > a.1 { b } else { a });
    best.map_or(Coding::Identity, |(coding, _)| coding)
}

/// Format and coding of a body, by its headers.
#[derive(Debug)]
pub struct Announcement {
    pub format: BodyFormat,
    pub coding: Coding,
    /// 415 for a body without a type, which is JSON if it begins with `{` and refused otherwise.
    pub unless_object: Option<Problem>,
}

impl Announcement {
    /// Reads `Content-Type` and `Content-Encoding`.
    ///
    /// Programs may leave out the type of JSON. Pages in a browser may not: without a type, a page of any
    /// origin could send a body that this server computes, because browsers only ask for permission first
    /// (by a CORS preflight) if there is a type such as that of JSON.
    ///
    /// # Errors
    /// 415 `unsupported-media-type` for a media type not in `formats`, or a coding other than gzip and zstd.
    pub fn of(headers: &HeaderMap, formats: &[BodyFormat]) -> Result<Self, Problem> {
        let text = |name| headers.get(name).and_then(|value| value.to_str().ok());
        let essence =
            text(header::CONTENT_TYPE).and_then(|value| value.split(';').next()).unwrap_or("").trim();
        let coding = announced_coding(text(header::CONTENT_ENCODING).unwrap_or("identity").trim())?;
        if let Some(&format) = formats.iter().find(|it| essence.eq_ignore_ascii_case(it.media_type())) {
            return Ok(Self { format, coding, unless_object: None });
        }
        let found = if essence.is_empty() { "no Content-Type" } else { essence };
        let detail = format!(
            "expected Content-Type: {}, found {found:?}",
            names(formats.iter().map(|format| format.media_type()))
        );
        let refusal = Problem::new(catalogue::UNSUPPORTED_MEDIA_TYPE, detail);
        let may_be_object = essence.is_empty()
            && coding == Coding::Identity
            && formats.contains(&BodyFormat::Json)
            && !headers.contains_key(header::ORIGIN);
        if may_be_object {
            Ok(Self { format: BodyFormat::Json, coding, unless_object: Some(refusal) })
        } else {
            Err(refusal)
        }
    }
}

fn announced_coding(name: &str) -> Result<Coding, Problem> {
    let known = [Coding::Identity, Coding::Gzip, Coding::Zstd];
    known.into_iter().find(|known| name.eq_ignore_ascii_case(known.name())).ok_or_else(|| {
        let detail = format!("Content-Encoding {name:?} is not supported; send gzip, zstd or neither");
        Problem::new(catalogue::UNSUPPORTED_MEDIA_TYPE, detail)
    })
}

/// Joins all lines of a list header. `None` if the header is absent.
fn list_of(headers: &HeaderMap, name: &HeaderName) -> Option<String> {
    let lines: Vec<&str> = headers.get_all(name).iter().filter_map(|value| value.to_str().ok()).collect();
    (!lines.is_empty()).then(|| lines.join(","))
}

/// Splits a list header into lower-case entries and their weights. The default weight is 1.
fn weights(list: &str) -> impl Iterator<Item = (String, f64)> {
    list.split(',').map(|entry| {
        let mut parts = entry.split(';').map(str::trim);
        let name = parts.next().unwrap_or_default().to_ascii_lowercase();
        let weight = parts.find_map(|part| part.strip_prefix("q=").or(part.strip_prefix("Q=")));
        (name, weight.and_then(|weight| weight.parse().ok()).unwrap_or(1.0))
    })
}

fn names<'a>(media_types: impl Iterator<Item = &'a str>) -> String {
    media_types.collect::<Vec<_>>().join(" or ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Format; 3] = [Format::Json, Format::Safetensors, Format::Npy];

    fn headers(name: HeaderName, value: &str) -> HeaderMap {
        HeaderMap::from_iter([(name, value.parse().unwrap())])
    }

    fn format(accept: &str, offered: &[Format]) -> Option<Format> {
        accepted_format(&headers(header::ACCEPT, accept), offered).ok()
    }

    #[test]
    fn the_most_specific_range_decides() {
        for accept in ["application/json", "*/*", "text/html, application/*;q=0.1", "APPLICATION/JSON; q=0.5"]
        {
            assert_eq!(format(accept, &[Format::Json]), Some(Format::Json), "{accept}");
        }
        for refused in ["text/html", "application/json;q=0, */*", "application/x-npy", ""] {
            assert_eq!(format(refused, &[Format::Json]), None, "{refused}");
        }
        assert_eq!(accepted_format(&HeaderMap::new(), &ALL).ok(), Some(Format::Json));
    }

    #[test]
    fn the_greatest_weight_wins_then_the_name_then_the_order() {
        for (accept, expected) in [
            ("application/x-npy", Format::Npy),
            ("application/x-npy, */*", Format::Npy),
            ("application/x-npy, application/json", Format::Json),
            ("application/x-npy;q=0.5, application/x-safetensors", Format::Safetensors),
            ("application/json;q=0.1, */*;q=0.2", Format::Safetensors),
            ("*/*", Format::Json),
        ] {
            assert_eq!(format(accept, &ALL), Some(expected), "{accept}");
        }
        assert_eq!(format("application/x-npy", &ALL[..2]), None);
    }

    #[test]
    fn the_coding_is_the_best_that_both_have() {
        let coding =
            |accept: &str, format| accepted_coding(&headers(header::ACCEPT_ENCODING, accept), format);
        for (accept, json, npy) in [
            ("", Coding::Identity, Coding::Identity),
            ("gzip", Coding::Gzip, Coding::Identity),
            ("gzip, deflate", Coding::Gzip, Coding::Identity),
            ("gzip, zstd", Coding::Zstd, Coding::Identity),
            ("gzip, zstd;q=0.9", Coding::Gzip, Coding::Identity),
            ("*", Coding::Zstd, Coding::Identity),
            ("br", Coding::Identity, Coding::Identity),
            ("gzip;q=0.5, identity", Coding::Identity, Coding::Identity),
            ("gzip, identity;q=0.5", Coding::Gzip, Coding::Gzip),
            ("zstd, identity;q=0", Coding::Zstd, Coding::Zstd),
            ("gzip, *;q=0", Coding::Gzip, Coding::Gzip),
            ("identity;q=0", Coding::Identity, Coding::Identity),
            ("gzip;q=0, *", Coding::Zstd, Coding::Identity),
        ] {
            assert_eq!(coding(accept, Format::Json), json, "{accept}");
            assert_eq!(coding(accept, Format::Npy), npy, "{accept}");
        }
        assert_eq!(accepted_coding(&HeaderMap::new(), Format::Json), Coding::Identity);
    }
}
