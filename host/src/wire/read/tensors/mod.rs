//! Requests as safetensors or npy, where tensors replace the arrays of JSON.
//!
//! The same types read all formats, so every check and every pointer is the same.

pub mod npy;

mod tensor;

use std::borrow::Cow;

use safetensors::SafeTensors;

use super::parse::Document;
use super::reader::NamedTable;
use crate::problem::Problem;
use crate::problem::catalogue;
use npy::Npy;
use tensor::Tensor;

/// Most segments of a tensor name, as in `surface.cloud.points`. The last segment keeps any further dots.
const MAX_DEPTH: usize = 3;

/// Longest header in bytes.
///
/// A header holds names, shapes and the members that are not numeric lists, which take a few hundred bytes.
/// Parsing turns a header into maps and strings of several times its size before anything in it is checked,
/// so it has a limit of its own. The numbers after the header are read in place.
const MAX_HEADER_BYTES: usize = 64 << 10;

/// The text of a request that has no members beside its tensors.
const NOTHING: &[u8] = b"{}";

/// Most tensors of a request, more than any request has names for.
const MAX_TENSORS: usize = 64;

/// Reads the header of a safetensors body.
///
/// Tensors are named like the arrays of the JSON, with a dot for nested objects (`cloud.points`). All other
/// members are JSON text in the metadata entry `request`.
///
/// # Errors
/// - 400 for a body that is not safetensors.
/// - 413 for a header beyond the limit.
/// - 422 for too many tensors.
pub fn read_safetensors(bytes: &[u8]) -> Result<Document<'_>, Problem> {
    let malformed =
        |error| Problem::new(catalogue::MALFORMED_BODY, format!("the body is not safetensors: {error}"));
    check_header(bytes)?;
    let tensors = SafeTensors::deserialize(bytes).map_err(malformed)?;
    if tensors.len() > MAX_TENSORS {
        let detail =
            format!("the body has {} tensors; no request takes more than {MAX_TENSORS}", tensors.len());
        return Err(Problem::invalid_request("", detail));
    }
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(malformed)?;
    let text = metadata.metadata().as_ref().and_then(|entries| entries.get("request"));
    let text = text.map_or(Cow::Borrowed(NOTHING), |text| text.clone().into_bytes().into());
    let mut tensors = tensors.tensors();
    // By name, so that the tensors of an object stand side by side.
    tensors.sort_by(|(one, _), (other, _)| one.split('.').cmp(other.split('.')));
    let named = tensors.iter().map(|(name, tensor)| {
        let path = name.splitn(MAX_DEPTH, '.').map(str::to_owned).collect();
        NamedTable::new(path, Tensor::of_view(tensor))
    });
    Ok(Document::with_tables(text, named.collect()))
}

/// Checks the length of the header, stated in the first eight bytes.
///
/// A length beyond the body is left for the parser to refuse.
fn check_header(bytes: &[u8]) -> Result<(), Problem> {
    let length = bytes.first_chunk().map(|&length| u64::from_le_bytes(length));
    match length.and_then(|length| usize::try_from(length).ok()) {
        Some(length) if length > MAX_HEADER_BYTES && length < bytes.len() => {
            let what = "bytes of safetensors header";
            Err(Problem::too_large(catalogue::BODY_TOO_LARGE, what, MAX_HEADER_BYTES, Some(length))
                .with_remedy("send lists of numbers as tensors, and in the metadata only what is needed"))
        }
        _ => Ok(()),
    }
}

/// Reads the header of an npy array, which is the member `points`.
///
/// # Errors
/// 400 for a body that is not npy.
pub fn read_npy(bytes: &[u8]) -> Result<Document<'_>, Problem> {
    let array = Npy::parse(bytes, MAX_HEADER_BYTES).and_then(Npy::into_table);
    let table =
        array.ok_or_else(|| Problem::new(catalogue::MALFORMED_BODY, "the body is not npy, or ends early"))?;
    Ok(Document::with_tables(NOTHING.into(), vec![NamedTable::new(vec!["points".to_owned()], table)]))
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use safetensors::Dtype;
    use safetensors::tensor::TensorView;
    use serde::Deserialize;
    use serde::de::DeserializeOwned;

    use super::*;
    use crate::problem::slug::Slug;
    use crate::testing::unlimited;
    use crate::wire::read::members::present_unless_empty;
    use crate::wire::read::points::Points;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Request {
        points: Points,
        values: Option<Vec<f64>>,
        alpha: Option<f64>,
        geometry: Option<Geometry>,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Geometry {
        noise: Vec<f64>,
        alpha: Option<f64>,
    }

    fn bytes(numbers: &[f64]) -> Vec<u8> {
        numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
    }

    type Given<'a> = (&'a str, Dtype, &'a [usize], Vec<u8>);

    fn safetensors(tensors: &[Given<'_>], request: Option<&str>) -> Vec<u8> {
        let views = tensors.iter().map(|(name, dtype, shape, data)| {
            (*name, TensorView::new(*dtype, shape.to_vec(), data).unwrap())
        });
        let metadata = request.map(|text| HashMap::from([("request".to_owned(), text.to_owned())]));
        safetensors::serialize(views, metadata).unwrap()
    }

    fn parse_safetensors<T: DeserializeOwned>(body: &[u8]) -> Result<T, Problem> {
        read_safetensors(body)?.parse(&unlimited())
    }

    fn parse_npy(body: &[u8]) -> Result<Request, Problem> {
        read_npy(body)?.parse(&unlimited())
    }

    fn refused(body: &[u8]) -> (Slug, String) {
        describe(&parse_safetensors::<Request>(body).unwrap_err())
    }

    fn describe(problem: &Problem) -> (Slug, String) {
        let document = serde_json::to_value(problem.document("")).unwrap();
        (problem.slug(), document["errors"][0]["pointer"].as_str().unwrap_or("-").to_owned())
    }

    fn points() -> Given<'static> {
        ("points", Dtype::F64, &[2, 3], bytes(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))
    }

    #[test]
    fn tensors_stand_where_json_has_arrays() {
        let values = [0.1f32, 0.2].iter().flat_map(|x| x.to_le_bytes()).collect();
        let noise = ("geometry.noise", Dtype::F64, &[1][..], bytes(&[0.5]));
        let tensors = [points(), ("values", Dtype::F32, &[2], values), noise];
        let body = safetensors(&tensors, Some(r#"{"alpha": 0.25, "geometry": {"alpha": 2}}"#));
        let request: Request = parse_safetensors(&body).unwrap();
        assert_eq!(request.points.coordinates, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!((request.points.dimension, request.alpha), (3, Some(0.25)));
        assert_eq!(request.values.unwrap(), [f64::from(0.1f32), f64::from(0.2f32)]);
        let geometry = request.geometry.unwrap();
        assert_eq!((geometry.noise, geometry.alpha), (vec![0.5], Some(2.0)));
        // Without the metadata entry there are only tensors.
        assert_eq!(parse_safetensors::<Request>(&safetensors(&[points()], None)).unwrap().alpha, None);
    }

    #[test]
    fn what_does_not_belong_is_pointed_to() {
        let with = |tensor: Given<'_>, request| refused(&safetensors(&[points(), tensor], request));
        let number = || bytes(&[1.0]);
        for (tensor, request, pointer) in [
            (("frobnicate", Dtype::F64, &[1][..], number()), None, "/frobnicate"),
            (("geometry.noise.x", Dtype::F64, &[1], number()), None, "/geometry/noise"),
            (("values", Dtype::F64, &[1], number()), Some(r#"{"values": [1]}"#), "/values"),
            (("geometry.noise", Dtype::F64, &[1], number()), Some(r#"{"geometry": 3}"#), "/geometry"),
            (("values", Dtype::F64, &[1, 1], number()), None, "/values/0"),
            (("values", Dtype::F64, &[], number()), None, "/values"),
            (("values", Dtype::F64, &[1, 1, 1], number()), None, "/values"),
            (("values", Dtype::I64, &[1], number()), None, "/values"),
            (("alpha", Dtype::F64, &[1], number()), None, "/alpha"),
            (("values", Dtype::F64, &[2], bytes(&[1.0, f64::NAN])), None, "/values/1"),
            (("geometry.noise", Dtype::F64, &[2], bytes(&[1.0, f64::INFINITY])), None, "/geometry/noise/1"),
            (("values", Dtype::F64, &[1], number()), Some(r#"{"alpha": null}"#), "/alpha"),
        ] {
            let name = tensor.0;
            assert_eq!(with(tensor, request), (catalogue::INVALID_REQUEST, pointer.to_owned()), "{name}");
        }
        let rows = |shape| refused(&safetensors(&[("points", Dtype::F64, shape, bytes(&[1.0, 2.0]))], None));
        assert_eq!(rows(&[2]), (catalogue::INVALID_REQUEST, "/points/0".to_owned()));
        let empty = safetensors(&[("points", Dtype::F64, &[1 << 60, 0], vec![])], None);
        assert_eq!(refused(&empty), (catalogue::INVALID_REQUEST, "/points".to_owned()));
        let infinite = ("points", Dtype::F64, &[1, 2][..], bytes(&[1.0, f64::NEG_INFINITY]));
        assert_eq!(
            refused(&safetensors(&[infinite], None)),
            (catalogue::INVALID_REQUEST, "/points/0/1".to_owned())
        );
    }

    #[test]
    fn lists_of_numbers_are_tensors_and_lists_of_words_are_not() {
        #[derive(Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        struct WithWords {
            #[serde(default, deserialize_with = "present_unless_empty")]
            normals: Option<Points>,
            #[serde(default, deserialize_with = "present_unless_empty")]
            noise_variances: Option<Vec<f64>>,
            include: Option<Vec<String>>,
            geometry: Option<Box<WithWords>>,
        }
        let parse =
            |tensors: &[Given<'_>], text| parse_safetensors::<WithWords>(&safetensors(tensors, Some(text)));
        let text = r#"{"include": ["a", "b"], "normals": [], "geometry": {"noise_variances": []}}"#;
        let request = parse(&[], text).unwrap();
        assert_eq!(request.include.unwrap(), ["a", "b"]);
        assert!(request.normals.is_none() && request.geometry.unwrap().noise_variances.is_none());
        let noise = || ("geometry.noise_variances", Dtype::F64, &[1][..], bytes(&[1.0]));
        for (tensors, text, pointer) in [
            (vec![], r#"{"normals": [[1, 2]]}"#, "/normals"),
            (vec![], r#"{"noise_variances": [1]}"#, "/noise_variances"),
            (vec![noise()], r#"{"geometry": {"normals": [[0]]}}"#, "/geometry/normals"),
        ] {
            let problem = parse(&tensors, text).unwrap_err();
            assert_eq!(describe(&problem), (catalogue::INVALID_REQUEST, pointer.to_owned()));
            assert!(serde_json::to_string(&problem.document("")).unwrap().contains("belong in tensors"));
        }
        let both = parse(&[noise()], r#"{"geometry": {"noise_variances": []}}"#).unwrap_err();
        assert_eq!(describe(&both), (catalogue::INVALID_REQUEST, "/geometry/noise_variances".to_owned()));
        let crossed = [noise(), ("geometry", Dtype::F64, &[1][..], bytes(&[1.0]))];
        assert_eq!(
            describe(&parse(&crossed, "{}").unwrap_err()),
            (catalogue::INVALID_REQUEST, "/geometry".to_owned())
        );
    }

    #[test]
    fn what_is_no_safetensors_is_malformed() {
        let good = safetensors(&[points()], Some("{}"));
        for broken in [&good[..good.len() - 1], &good[..4], &[], b"{\"points\": [[1, 2]]}", &[0xff; 100]] {
            assert_eq!(refused(broken).0, catalogue::MALFORMED_BODY);
        }
        assert_eq!(refused(&safetensors(&[points()], Some("{"))).0, catalogue::MALFORMED_JSON);
        assert_eq!(refused(&safetensors(&[points()], Some("3"))).0, catalogue::INVALID_REQUEST);
        let deep = "geometry.".repeat(5000);
        let nested = safetensors(&[points(), (&deep, Dtype::F64, &[0], vec![])], None);
        assert_eq!(refused(&nested), (catalogue::INVALID_REQUEST, "/geometry/geometry".to_owned()));
    }

    fn npy(descr: &str, fortran: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let header =
            format!("{{'descr': '{descr}', 'fortran_order': {fortran}, 'shape': {shape}, }}            \n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.bytes());
        bytes.extend(data);
        bytes
    }

    #[test]
    fn npy_of_any_order_and_width_is_one_list_of_points() {
        let rows = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
        let columns = [1.0, 4.0, 2.0, 5.0, 3.0, 6.0];
        let big: Vec<u8> = rows.iter().flat_map(|x: &f64| x.to_be_bytes()).collect();
        let single: Vec<u8> = rows.iter().flat_map(|&x| (x as f32).to_le_bytes()).collect();
        let big_single: Vec<u8> = columns.iter().flat_map(|&x| (x as f32).to_be_bytes()).collect();
        for body in [
            npy("<f8", "False", "(2, 3)", &bytes(&rows)),
            npy("<f8", "True", "(2, 3)", &bytes(&columns)),
            npy(">f8", "False", "(2, 3)", &big),
            npy("<f4", "False", "(2,3,)", &single),
            npy(">f4", "True", "( 2, 3 )", &big_single),
        ] {
            let request: Request = parse_npy(&body).unwrap();
            assert_eq!((request.points.coordinates.as_slice(), request.points.dimension), (&rows[..], 3));
        }
    }

    #[test]
    fn npy_that_is_none_is_malformed_and_other_arrays_are_refused() {
        let data = bytes(&[1.0, 2.0]);
        let refused = |body: &[u8]| describe(&parse_npy(body).unwrap_err());
        let good = npy("<f8", "False", "(1, 2)", &data);
        assert!(parse_npy(&good).is_ok());
        for broken in [&good[..good.len() - 1], &good[..20], &good[..9], &good[1..], &[]] {
            assert_eq!(refused(broken).0, catalogue::MALFORMED_BODY);
        }
        for shape in ["(2, 2)", "(-1, 2)", "(18446744073709551615, 2)", "(1e3, 2)", "[1, 2]", "(1, 2"] {
            assert_eq!(refused(&npy("<f8", "False", shape, &data)).0, catalogue::MALFORMED_BODY, "{shape}");
        }
        assert_eq!(refused(&npy("<f8", "Maybe", "(1, 2)", &data)).0, catalogue::MALFORMED_BODY);
        for (descr, shape, pointer) in [
            ("<i8", "(1, 2)", "/points"),
            ("|O", "(1, 2)", "/points"),
            ("<f8", "(2,)", "/points/0"),
            ("<f8", "(1, 1, 2)", "/points"),
            ("<f8", "()", "/points"),
        ] {
            let body = npy(descr, "False", shape, if shape == "()" { &data[..8] } else { &data });
            assert_eq!(refused(&body), (catalogue::INVALID_REQUEST, pointer.to_owned()), "{descr} {shape}");
        }
        let not_finite = npy("<f8", "False", "(1, 2)", &bytes(&[1.0, f64::NAN]));
        assert_eq!(refused(&not_finite), (catalogue::INVALID_REQUEST, "/points/0/1".to_owned()));
    }
}
