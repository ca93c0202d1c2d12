//! Tests of reading PLY files and of the refusals of invalid ones.

use serde::Deserialize;

use super::*;
use crate::problem::slug::Slug;
use crate::testing::{lists, unlimited};
use crate::wire::read::limits::ParseContext;
use crate::wire::read::members::present_unless_empty;
use crate::wire::read::points::Points;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Request {
    points: Points,
    #[serde(default, deserialize_with = "present_unless_empty")]
    normals: Option<Points>,
}

fn parse(body: &[u8]) -> Result<Request, Problem> {
    read_ply(body)?.parse(&unlimited())
}

fn read(body: &[u8]) -> (Vec<f64>, Option<Vec<f64>>) {
    let request = parse(body).unwrap_or_else(|problem| panic!("{problem:?}"));
    assert!(request.points.dimension == 3 || request.points.n_rows == 0);
    (request.points.coordinates, request.normals.map(|normals| normals.coordinates))
}

/// Slug, pointer and detail of a refusal.
fn refused(body: &[u8]) -> (Slug, String, String) {
    let problem = parse(body).unwrap_err();
    let document = serde_json::to_value(problem.document("")).unwrap();
    let text = |value: &serde_json::Value| value.as_str().unwrap_or("-").to_owned();
    (problem.slug(), text(&document["errors"][0]["pointer"]), text(&document["detail"]))
}

fn file(format: &str, header: &[&str], data: &[u8]) -> Vec<u8> {
    let format = format!("format {format} 1.0");
    let lines = ["ply", &format].into_iter().chain(header.iter().copied());
    let head: String = lines.chain(["end_header"]).map(|line| format!("{line}\n")).collect();
    [head.as_bytes(), data].concat()
}

const VERTICES: [&str; 4] = ["element vertex 2", "property float x", "property float y", "property float z"];

#[test]
fn text_is_read_as_it_is_written() {
    let body = file("ascii", &VERTICES, b"0.1 -2e3 3\n+4 5. 6.5");
    assert_eq!(read(&body), (vec![0.1, -2e3, 3.0, 4.0, 5.0, 6.5], None));
    let crlf = String::from_utf8(body).unwrap().replace('\n', "\r\n");
    assert_eq!(read(crlf.as_bytes()).0, [0.1, -2e3, 3.0, 4.0, 5.0, 6.5]);
    let blank = file("ascii", &VERTICES, b"\n 1\t2 3  \r\n\r\n4 5 6\n");
    assert_eq!(read(&blank).0, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
}

#[test]
fn other_properties_and_elements_are_passed_over() {
    let header = [
        "comment \u{e4} scan, end_header",
        "element camera 1",
        "property list uchar int views",
        "property float focus",
        "obj_info num_cols 512",
        "element nothing 4000000000",
        "element vertex 2",
        "property float confidence",
        "property double nx",
        "property float x",
        "property list uchar short edges",
        "property double nz",
        "property int z",
        "property float y",
        "property double ny",
        "element face 1",
        "property list uchar int vertex_indices",
    ];
    let text = b"2 7 8 35.5\n0.5 1 10 0 3 30 20 2\n0.5 4 40 2 7 8 6 60 50 5\nthis is not looked at";
    let expected = (vec![10.0, 20.0, 30.0, 40.0, 50.0, 60.0], Some(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    assert_eq!(read(&file("ascii", &header, text)), expected);
    for (format, is_big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
        let mut data = Vec::new();
        let mut put =
            |bytes: &[u8]| if is_big { data.extend(bytes.iter().rev()) } else { data.extend(bytes) };
        put(&[2]);
        [7_i32, 8].iter().for_each(|i| put(&i.to_le_bytes()));
        put(&35.5_f32.to_le_bytes());
        for (k, edges) in [(0_u8, &[][..]), (1, &[7_i16, 8])] {
            let x = 30.0 * f32::from(k);
            put(&0.5_f32.to_le_bytes());
            put(&f64::from(1 + 3 * k).to_le_bytes());
            put(&(x + 10.0).to_le_bytes());
            put(&[edges.len() as u8]);
            edges.iter().for_each(|edge| put(&edge.to_le_bytes()));
            put(&f64::from(3 + 3 * k).to_le_bytes());
            put(&(30 + 30 * i32::from(k)).to_le_bytes());
            put(&(x + 20.0).to_le_bytes());
            put(&f64::from(2 + 3 * k).to_le_bytes());
        }
        put(&[3, 0]);
        assert_eq!(read(&file(format, &header, &data)), expected, "{format}");
    }
}

#[test]
fn coordinates_may_have_any_type() {
    for (names, bytes) in [
        (["char", "int8"], (-2_i8).to_le_bytes().to_vec()),
        (["uchar", "uint8"], 200_u8.to_le_bytes().to_vec()),
        (["short", "int16"], (-300_i16).to_le_bytes().to_vec()),
        (["ushort", "uint16"], 60_000_u16.to_le_bytes().to_vec()),
        (["int", "int32"], (-70_000_i32).to_le_bytes().to_vec()),
        (["uint", "uint32"], 4_000_000_000_u32.to_le_bytes().to_vec()),
        (["float", "float32"], 0.1_f32.to_le_bytes().to_vec()),
        (["double", "float64"], 0.1_f64.to_le_bytes().to_vec()),
    ] {
        for name in names {
            let properties = ["x", "y", "z"].map(|axis| format!("property {name} {axis}"));
            let [x, y, z] = &properties;
            let header = ["element vertex 1", x, y, z];
            let (little, _) = read(&file("binary_little_endian", &header, &bytes.repeat(3)));
            let reversed: Vec<u8> = bytes.iter().rev().copied().collect();
            assert_eq!(read(&file("binary_big_endian", &header, &reversed.repeat(3))).0, little);
            let words = format!("{0} {0} {0}", little[0]);
            assert_eq!(read(&file("ascii", &header, words.as_bytes())).0, little, "{name}");
        }
    }
}

#[test]
fn normals_are_there_only_with_all_three_components() {
    let header = |names: &[&str]| -> Vec<String> {
        let property = |name: &&str| format!("property float {name}");
        ["element vertex 1".to_owned()].into_iter().chain(names.iter().map(property)).collect()
    };
    for (names, expected) in [
        (&["x", "y", "z", "nx", "ny"][..], None),
        (&["nx", "nz", "x", "y", "z"], None),
        (&["x", "y", "z", "nz", "ny", "nx"], Some(vec![6.0, 5.0, 4.0])),
    ] {
        let lines = header(names);
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        let words: Vec<String> = (1..=names.len()).map(|k| k.to_string()).collect();
        assert_eq!(read(&file("ascii", &lines, words.join(" ").as_bytes())).1, expected, "{names:?}");
    }
}

#[test]
fn headers_that_lie_are_refused_before_anything_is_made_room_for() {
    let good = file("ascii", &VERTICES, b"1 2 3\n4 5 6\n");
    let text = String::from_utf8(good).unwrap();
    for (from, to, said) in [
        ("ply\n", "PLY\n", "its first line is not \"ply\""),
        ("end_header\n", "", "this"),
        ("end_header\n", "end_headers\n", "line 7 of the header"),
        ("format ascii 1.0\n", "", "no line \"format\""),
        ("ascii 1.0", "ascii 1.1", "none of ascii"),
        ("ascii 1.0", "binary_middle_endian 1.0", "none of ascii"),
        ("ascii 1.0\n", "ascii 1.0\nformat ascii 1.0\n", "twice"),
        ("vertex 2", "vertex 3", "at most 2 fit"),
        ("1 2 3\n4 5 6", "1000 2000 3000", "at number 1 of 2"),
        ("vertex 2", "vertex 5", "at most 2 fit"),
        ("vertex 2", "vertex 18446744073709551615", "at most 2 fit"),
        ("vertex 2", "vertex 18446744073709551616", "an impossible count"),
        ("vertex 2", "vertex -1", "an impossible count"),
        ("vertex 2", "vertex +2", "an impossible count"),
        ("vertex 2", "vertex", "is no line of a header"),
        ("element vertex 2\n", "property float q\nelement vertex 2\n", "belongs to no element"),
        ("property float z", "property float x", "a second property \"x\""),
        ("property float z", "property real z", "\"real\" is no type"),
        ("property float z", "property float z\nproperty list float int q", "whole number"),
        ("property float z", "property float z\nproperty list uchar q", "a type and a name"),
        ("property float z", "property float z\nelement vertex 2", "a second element"),
        ("1 2 3", "100 2", "line 8, element vertex: there are too few numbers"),
        ("1 2 3", "1 2 3 4", "line 8, element vertex: there are more numbers"),
        ("4 5 6", "4 five 6", "line 9, element vertex: \"five\" is no number"),
        ("4 5 6", "4 0x5 6", "line 9"),
    ] {
        assert!(text.contains(from), "{from}");
        let (slug, _, detail) = refused(text.replace(from, to).as_bytes());
        let said = if said == "this" { "line 7 of the header" } else { said };
        assert!(slug == catalogue::MALFORMED_BODY && detail.contains(said), "{to}: {slug:?} {detail}");
    }
    let endless = text.replace("end_header", &"comment\n".repeat(20_000));
    assert!(refused(endless.as_bytes()).2.contains("does not end"));
    assert!(refused(b"").2.contains("first line") && refused(b"ply\n").2.contains("does not end"));
}

#[test]
fn binary_that_ends_early_is_refused() {
    let header = ["element face 1", "property list int int q"];
    let header = |length: i32, n_vertices: usize| {
        let lines: Vec<String> = header.iter().chain(&VERTICES[1..]).map(|&line| line.to_owned()).collect();
        let vertex = format!("element vertex {n_vertices}");
        let lines = [&lines[0], &lines[1], &vertex, &lines[2], &lines[3], &lines[4]].map(String::as_str);
        file("binary_little_endian", &lines, &[&length.to_le_bytes()[..], &[0; 24]].concat())
    };
    assert_eq!(read(&header(0, 2)).0, [0.0; 6]);
    assert_eq!(read(&header(3, 1)).0, [0.0; 3]);
    for (length, n_vertices, said) in [
        (-1, 1, "face 0: a list has -1 entries"),
        (7, 1, "ends within element face"),
        (i32::MAX, 1, "ends within element face"),
        (0, 3, "announces 3 of element vertex, but at most 2 fit"),
        (4, 1, "announces 1 of element vertex, but at most 0 fit"),
        (0, usize::MAX, "at most 2 fit"),
    ] {
        let (slug, _, detail) = refused(&header(length, n_vertices));
        assert!(slug == catalogue::MALFORMED_BODY && detail.contains(said), "{length}: {detail}");
    }
}

#[test]
fn what_is_a_file_but_no_cloud_points_to_its_place() {
    let refused_at = |header: &[&str], data: &[u8]| {
        let (slug, pointer, detail) = refused(&file("ascii", header, data));
        assert_eq!(slug, catalogue::INVALID_REQUEST, "{detail}");
        (pointer, detail)
    };
    assert_eq!(refused_at(&["element face 0"], b"").0, "/points");
    let (pointer, detail) = refused_at(&VERTICES[..3], b"1 2\n3 4\n");
    assert!(pointer == "/points" && detail.contains("no number z"), "{detail}");
    let listed = ["element vertex 0", "property float x", "property float y", "property list uchar float z"];
    assert!(refused_at(&listed, b"").1.contains("no number z"));
    for word in ["nan", "inf", "-inf", "1e999"] {
        let (pointer, detail) = refused_at(&VERTICES, format!("1 2 3\n4 {word} 6\n").as_bytes());
        assert!(pointer == "/points/1/1" && detail.contains("is not finite"), "{word}: {pointer} {detail}");
    }
    // Errors about points as a cloud are reported later, where the cloud is made.
    let none = ["element vertex 0", VERTICES[1], VERTICES[2], VERTICES[3]];
    assert!(read(&file("ascii", &none, b"")).0.is_empty());
}

#[test]
fn more_vertices_than_the_limit_are_not_read() {
    let lists = lists(1, 1, usize::MAX);
    let context = ParseContext { lists: &lists, ..unlimited() };
    let body = file("ascii", &VERTICES, b"these are no numbers\n4 5 6\n");
    let problem = read_ply(&body).unwrap().parse::<Request>(&context).unwrap_err();
    let document = serde_json::to_value(problem.document("")).unwrap();
    assert_eq!((problem.slug(), &document["required"]), (catalogue::PROBLEM_TOO_LARGE, &2.into()));
    assert_eq!(document["errors"][0]["pointer"], "/points");
}
