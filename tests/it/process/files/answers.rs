//! Answers of subcommands: their formats, where they come from, and the line of success.

use serde_json::{Value, json};

use super::{Folder, code, sphere, told};
use crate::support::{Server, fibonacci_sphere, receive, unpooled};

#[test]
fn a_scan_becomes_curvatures_normals_and_a_mesh() {
    let folder = Folder::new("scan");
    folder.write("scan.xyz", &sphere(300));
    for (arguments, begins) in [
        (["curvatures", "scan.xyz", "-o", "curvatures.ply", "--std"].as_slice(), "ply"),
        (&["normals", "scan.xyz", "-o", "normals.json"], "{"),
        (&["mesh", "scan.xyz", "-o", "scan.glb"], "glTF"),
        (&["mesh", "scan.xyz", "-o", "scan.obj", "--with", r#"{"quality": "raw"}"#], "v "),
        // What was written can be read.
        (&["normals", "curvatures.ply", "-o", "again.ply"], "ply"),
    ] {
        let output = folder.run(arguments);
        assert!(told(&output).contains(&format!("wrote {}", arguments[3])), "{}", told(&output));
        assert_eq!(code(&output), Some(0), "{arguments:?}");
        assert!(folder.read(arguments[3]).starts_with(begins.as_bytes()), "{arguments:?}");
    }
    let found = folder.read("curvatures.ply");
    let text = String::from_utf8_lossy(&found);
    for line in ["element vertex 300", "property float mean_curvature", "property float quality"] {
        assert!(text.contains(line), "{line}");
    }
    let normals: Value = serde_json::from_slice(&folder.read("normals.json")).unwrap();
    assert_eq!(normals["normals"].as_array().unwrap().len(), 300);
}

#[test]
fn any_request_is_answered_on_standard_output() {
    let folder = Folder::new("ask");
    let request = json!({
        "cloud": {"points": [[0.0], [1.0], [2.0]]}, "values": [0.0, 1.0, 0.0], "queries": [[1.0]],
        "kernel": {"family": "gauss", "length_scale": 1.0}, "alpha": 0.0,
    });
    folder.write("request.json", &request.to_string());
    let output = folder.run(&["ask", "interpolation", "request.json"]);
    assert_eq!(code(&output), Some(0));
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!((answer["values"][0].as_f64().unwrap() - 1.0).abs() < 1e-12);
}

#[test]
fn tables_with_decimal_commas_are_read_and_others_name_their_line() {
    let folder = Folder::new("tables");
    folder.write("commas.csv", &sphere(100).replace('.', ",").replace(' ', ";"));
    folder.write("points.csv", &sphere(100).replace(' ', ";"));
    for name in ["commas", "points"] {
        let ended = folder.run(&["normals", &format!("{name}.csv"), "-o", &format!("{name}.ply")]);
        assert_eq!(code(&ended), Some(0), "{}", String::from_utf8_lossy(&ended.stderr));
    }
    assert_eq!(folder.read("commas.ply"), folder.read("points.ply"));
    folder.write("shifted.csv", "x,y,z,q\n1,,3,4\n");
    let ended = folder.run(&["normals", "shifted.csv", "-o", "out.ply"]);
    let told = String::from_utf8_lossy(&ended.stderr);
    assert!(code(&ended) == Some(1) && told.contains("shifted.csv: line 2: cell 2 is empty"), "{told}");
}

#[tokio::test]
async fn models_are_those_of_the_service_to_the_last_byte() {
    let (folder, server) = (Folder::new("models"), Server::start().await);
    folder.write("scan.xyz", &sphere(300));
    for (command, operation, ending, media_type) in [
        ("curvatures", "curvatures", "ply", "model/ply"),
        ("mesh", "level-set", "ply", "model/ply"),
        ("mesh", "level-set", "glb", "model/gltf-binary"),
        ("mesh", "level-set", "obj", "model/obj"),
        ("normals", "normals", "safetensors", "application/x-safetensors"),
    ] {
        let file = format!("out.{ending}");
        let ended = folder.run(&[command, "scan.xyz", "-o", &file, "--std"]);
        assert_eq!(code(&ended), Some(0), "{}", told(&ended));
        let request = json!({"cloud": {"points": fibonacci_sphere(300)}, "include": ["std"]});
        let asking = unpooled().post(server.url(&format!("/v1/{operation}"))).header("accept", media_type);
        let answer = receive(asking.json(&request)).await;
        assert_eq!(answer.status, 200);
        assert!(answer.bytes == folder.read(&file), "{command} {ending}");
    }
}

/// Rows of a CSV file by the names of their columns.
fn rows_of(csv: &[u8]) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = std::str::from_utf8(csv).unwrap();
    let mut lines = text.lines().map(|line| line.split(','));
    let names = lines.next().unwrap().map(str::to_owned).collect();
    (names, lines.map(|cells| cells.map(|cell| cell.parse().unwrap()).collect()).collect())
}

#[test]
fn tables_have_all_numbers_the_flags_and_the_columns_of_the_file() {
    let folder = Folder::new("csv");
    let rows = fibonacci_sphere(300).into_iter().enumerate();
    let rows = rows.map(|(at, [x, y, z])| format!("{x},{y},{z},{at},{}\n", 0.5 * at as f64));
    folder.write("scan.csv", &format!("x,y,z,intensity,level\n{}", rows.collect::<String>()));
    let ended = folder.run(&["curvatures", "scan.csv", "-o", "out.csv", "--std"]);
    assert_eq!(code(&ended), Some(0), "{}", told(&ended));
    let (names, rows) = rows_of(&folder.read("out.csv"));
    let column = |name: &str| {
        let at =
            names.iter().position(|other| other == name).unwrap_or_else(|| panic!("{name} in {names:?}"));
        rows.iter().map(|row| row[at]).collect::<Vec<f64>>()
    };
    assert_eq!(rows.len(), 300);
    assert_eq!(column("x")[7], fibonacci_sphere(300)[7][0]);
    assert!(column("mean_curvature").iter().all(|h| (h - 1.0).abs() < 1e-2));
    assert!(column("normal_std").iter().all(|std| std.is_finite()) && column("flagged")[0] == 0.0);
    // The answer has levels of its own.
    assert_eq!((column("intensity")[41], column("file_level")[41]), (41.0, 20.5));
    let json = folder.run(&["curvatures", "scan.csv", "-o", "-", "--to", "json", "--std"]);
    let json: Value = serde_json::from_slice(&json.stdout).unwrap();
    let expected: Vec<f64> = serde_json::from_value(json["mean_curvatures"].clone()).unwrap();
    assert_eq!(column("mean_curvature"), expected);
    // What was written can be read.
    assert_eq!(code(&folder.run(&["normals", "out.csv"])), Some(0));
    // The same as a structured array.
    assert_eq!(code(&folder.run(&["curvatures", "scan.csv", "-o", "out.npy", "--std"])), Some(0));
    let array = folder.read("out.npy");
    let n_header = 12 + u32::from_le_bytes(array[8..12].try_into().unwrap()) as usize;
    let header = String::from_utf8_lossy(&array[12..n_header]);
    assert!(array.starts_with(b"\x93NUMPY\x03\x00") && n_header.is_multiple_of(64), "{header}");
    assert!(header.contains("('mean_curvature', '<f8')") && header.contains("'shape': (300,)"), "{header}");
    assert_eq!(array.len() - n_header, 300 * names.len() * 8);
}

#[test]
fn viewers_get_meshes_and_points_with_numbers() {
    let folder = Folder::new("viewers");
    folder.write("scan.xyz", &sphere(300));
    for arguments in [
        &["mesh", "scan.xyz", "-o", "mesh.stl"][..],
        &["mesh", "scan.xyz", "-o", "mesh.vtp", "--curvatures", "--std"],
        &["mesh", "scan.xyz", "-o", "mesh.json"],
        &["normals", "scan.xyz", "-o", "points.vtp"],
    ] {
        let ended = folder.run(arguments);
        assert_eq!(code(&ended), Some(0), "{}", told(&ended));
    }
    let mesh: Value = serde_json::from_slice(&folder.read("mesh.json")).unwrap();
    let n_cells = mesh["cells"].as_array().unwrap().len();
    let stl = folder.read("mesh.stl");
    assert_eq!(u32::from_le_bytes(stl[80..84].try_into().unwrap()) as usize, n_cells);
    assert_eq!(stl.len(), 84 + 50 * n_cells);
    // Normals of triangles point out of the sphere, as corners do.
    let float = |at: usize| f32::from_le_bytes(stl[at..at + 4].try_into().unwrap());
    for triangle in 0..n_cells {
        let at = 84 + 50 * triangle;
        let outward: f32 = (0..3).map(|axis| float(at + 4 * axis) * float(at + 12 + 4 * axis)).sum();
        assert!(outward > 0.9, "{triangle}: {outward}");
    }
    let vtp = folder.read("mesh.vtp");
    let xml = String::from_utf8_lossy(&vtp);
    let n_vertices = mesh["vertices"].as_array().unwrap().len();
    for part in [
        format!("NumberOfPoints=\"{n_vertices}\" NumberOfVerts=\"0\""),
        format!("NumberOfPolys=\"{n_cells}\""),
        "Scalars=\"mean_curvature\" Normals=\"Normals\"".to_owned(),
        "Name=\"mean_curvature_std\"".to_owned(),
        "Name=\"support\"".to_owned(),
    ] {
        assert!(xml.contains(&part), "{part}");
    }
    // Arrays stand where their offsets say, each after its length.
    let begin = b"<AppendedData encoding=\"raw\">\n_";
    let data = vtp.windows(begin.len()).position(|window| window == begin).unwrap() + begin.len();
    let offset = xml.split("Name=\"Points\"").nth(1).unwrap().split('"').nth(5).unwrap();
    let at = data + offset.parse::<usize>().unwrap();
    let word = |at: usize| vtp[at..at + 8].try_into().unwrap();
    assert_eq!(u64::from_le_bytes(word(at)) as usize, 24 * n_vertices);
    let first: Vec<f64> = (1..4).map(|axis| f64::from_le_bytes(word(at + 8 * axis))).collect();
    assert_eq!(json!(first), mesh["vertices"][0]);
    let points = folder.read("points.vtp");
    assert!(String::from_utf8_lossy(&points).contains("NumberOfVerts=\"300\""));
}

#[test]
fn clouds_come_from_standard_input_and_answers_go_to_standard_output() {
    let folder = Folder::new("standard");
    let cloud = sphere(100);
    let ended = folder.run_on(&["normals", "-"], &cloud);
    assert!(ended.stdout.starts_with(b"ply\n"), "{}", told(&ended));
    assert_eq!(told(&ended), "100 points, none flagged, wrote standard output\n");
    let ended = folder.run_on(&["normals", "-", "--to", "csv"], &cloud);
    assert!(ended.stdout.starts_with(b"x,y,z,nx,ny,nz,"), "{}", told(&ended));
    let vertices = format!("v {}", cloud.trim_end().replace('\n', "\nv "));
    let ended = folder.run_on(&["mesh", "-", "--from", "obj", "-o", "mesh.stl", "--quiet"], &vertices);
    assert_eq!((code(&ended), told(&ended)), (Some(0), String::new()));
    let ended = folder.run_on(&["mesh", "-", "--from", "ply"], &cloud);
    assert!(
        code(&ended) == Some(1) && told(&ended).contains("standard input: the file is not PLY"),
        "{}",
        told(&ended)
    );
    let request = json!({"cloud": {"points": fibonacci_sphere(50)}});
    let ended = folder.run_on(&["ask", "normals", "-"], &request.to_string());
    let answer: Value = serde_json::from_slice(&ended.stdout).unwrap();
    assert_eq!((answer["normals"].as_array().unwrap().len(), told(&ended)), (50, String::new()));
    assert_eq!(folder.names(), ["mesh.stl"]);
}

#[test]
fn several_clouds_have_answers_of_their_own() {
    let folder = Folder::new("several");
    folder.write("a.xyz", &sphere(100));
    folder.write("b.xyz", &sphere(200));
    let ended = folder.run(&["normals", "a.xyz", "b.xyz"]);
    let expected =
        "100 points, none flagged, wrote a-normals.ply\n200 points, none flagged, wrote b-normals.ply\n";
    assert_eq!((code(&ended), told(&ended).as_str()), (Some(0), expected));
    // A cloud that fails does not keep others from their answers, and decides the exit code.
    folder.write("a.xyz", "0 0 zero\n");
    let ended = folder.run(&["mesh", "a.xyz", "b.xyz", "-o", "meshes/", "--to", "stl"]);
    assert!(code(&ended) == Some(1) && told(&ended).contains("a.xyz: line 1"), "{}", told(&ended));
    assert_eq!(folder.names(), ["a-normals.ply", "a.xyz", "b-normals.ply", "b.xyz", "meshes"]);
    assert!(folder.0.join("meshes/b-mesh.stl").is_file());
    let ended = folder.run(&["normals", "a.xyz", "b.xyz", "-o", "one.ply"]);
    assert!(code(&ended) == Some(2) && told(&ended).contains("folder"), "{}", told(&ended));
}
