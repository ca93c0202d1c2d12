//! Refusals and warnings in the words of files, points and options.

use super::{Folder, code, told};
use crate::support::fibonacci_sphere;

#[test]
fn scripts_can_tell_what_went_wrong() {
    let folder = Folder::new("wrong");
    folder.write("twice.csv", "x,y\n0,0\n0,0\n1,0\n0,1\n");
    folder.write("text.xyz", "0 0 0\n0 0 zero\n");
    folder.write("half.json", "{");
    let cases = [
        (["normals", "absent.ply", "-o", "out.ply"].as_slice(), 1, "absent.ply"),
        (&["normals", "twice.csv", "-o", "out.docx"], 2, ".vtp"),
        (&["normals", "twice.csv", "-o", "out.ply", "--with", "{"], 2, "--with"),
        (&["normals", "text.xyz", "-o", "out.ply"], 1, "line 2"),
        (&["normals"], 2, "<CLOUD>"),
        (
            &["mesh", "twice.csv", "-o", "out.ply", "--with", r#"{"step": -1}"#],
            3,
            "--step: step must be more than 0",
        ),
        (&["ask", "interpolation", "half.json"], 3, "half.json: the file is not JSON"),
        (&["ask", "no-such-thing", "half.json"], 3, "There are"),
    ];
    for (arguments, expected, part) in cases {
        let output = folder.run(arguments);
        let told = told(&output);
        assert_eq!(code(&output), Some(expected), "{arguments:?}: {told}");
        assert!(told.contains(part), "{arguments:?}: {told}");
        assert!(!folder.0.join("out.ply").exists());
    }
}

fn rows(points: &[[f64; 3]]) -> String {
    points.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect()
}

#[test]
fn refusals_name_files_points_and_options() {
    let folder = Folder::new("words");
    let mut points = fibonacci_sphere(200);
    folder.write("scan.xyz", &rows(&points));
    let half: Vec<[f64; 3]> = fibonacci_sphere(600).into_iter().filter(|[_, _, z]| *z > 0.0).collect();
    folder.write("half.xyz", &rows(&half));
    points[17] = points[18];
    folder.write("twice.xyz", &rows(&points));
    folder.write("nan.xyz", "0 0 1\n0 nan 0\n");
    for (arguments, parts) in [
        (&["normals", "nan.xyz"][..], &["nan.xyz: line 2: "][..]),
        (
            &["normals", "twice.xyz", "--alpha", "0"],
            &["twice.xyz: ", "--duplicates merge", "--alpha", "points 18, 19"],
        ),
        (&["mesh", "half.xyz"], &["half.xyz: ", "--open"]),
        (&["normals", "scan.xyz", "--alpha", "-1"], &["scan.xyz: --alpha: "]),
        (&["normals", "scan.xyz", "--kernel", "gaus"], &["scan.xyz: --kernel: ", "gauss"]),
        (&["normals", "scan.xyz", "--kernel", "gauss:wide"], &["--kernel gauss:wide", "matern:0.5"]),
        (&["normals", "scan.xyz", "--with", "{\"odd\": 1}"], &["--with: unknown member"]),
        (&["mesh", "scan.xyz", "--step", "1e-7"], &["scan.xyz: ", "--step"]),
        (&["normals", "scan.xyz", "--max-points", "5"], &["scan.xyz: ", "--max-points raises the limit"]),
        (&["normals", "scan.xyz", "--solver", "densee"], &["'dense'"]),
        (&["normals", "scan.xyz", "-o", "out.stl"], &["out.stl: ", "cannot hold", ".ply, .vtp, .csv"]),
        (&["mesh", "scan.xyz", "-o", "out.csv"], &["out.csv: ", "cannot hold a mesh", ".stl"]),
        (&["ask", "norms", "scan.xyz"], &["no operation norms", "normals"]),
    ] {
        let ended = folder.run(arguments);
        let told = told(&ended);
        assert_ne!(code(&ended), Some(0), "{arguments:?}");
        assert!(parts.iter().all(|part| told.contains(part)), "{arguments:?}: {told}");
        // No status of HTTP, no pointer into a request, and no member of it.
        let foreign = ["422", "413", "Unprocessable", "/alpha", "/cloud", "surface_model\"", "request"];
        let is_asking = arguments[0] == "ask" || arguments.contains(&"--with");
        assert!(is_asking || !foreign.iter().any(|word| told.contains(word)), "{told}");
    }
}

#[test]
fn remedies_help_when_they_are_typed_in() {
    let folder = Folder::new("remedies");
    let mut points = fibonacci_sphere(200);
    points[17] = points[18];
    folder.write("twice.xyz", &rows(&points));
    let half: Vec<[f64; 3]> = fibonacci_sphere(600).into_iter().filter(|[_, _, z]| *z > 0.0).collect();
    folder.write("half.xyz", &rows(&half));
    for (arguments, part) in [
        (&["normals", "twice.xyz", "--alpha", "0", "--duplicates", "merge"][..], "200 points"),
        (&["normals", "twice.xyz", "--alpha", "1e-6"], "200 points"),
        (&["mesh", "half.xyz", "--open"], "with a rim"),
        (&["normals", "half.xyz", "--kernel", "matern:0.5,nu=4.5", "--solver", "dense", "--std"], "points"),
        (&["curvatures", "half.xyz", "--surface", "regression"], "points"),
    ] {
        let ended = folder.run(arguments);
        assert!(code(&ended) == Some(0) && told(&ended).contains(part), "{arguments:?}: {}", told(&ended));
    }
}

#[test]
fn warnings_stand_before_the_line_of_success_and_count_points() {
    let folder = Folder::new("warnings");
    // A cube has sharp edges.
    let grid = |at: usize| at as f64 / 9.0;
    let mut points = Vec::new();
    for (u, v) in (0..100).map(|at| (grid(at / 10), grid(at % 10))) {
        points.extend([[u, v, 0.0], [u, v, 1.0], [u, 0.0, v], [u, 1.0, v], [0.0, u, v], [1.0, u, v]]);
    }
    points.sort_by(|a, b| a.partial_cmp(b).unwrap());
    points.dedup();
    folder.write("cube.xyz", &rows(&points));
    let ended = folder.run(&["curvatures", "cube.xyz", "-o", "cube.csv", "--surface", "regression"]);
    let text = told(&ended);
    let lines: Vec<&str> = text.lines().collect();
    let (last, warnings) = lines.split_last().unwrap();
    assert!(last.starts_with("488 points, ") && last.ends_with(" flagged, wrote cube.csv"), "{text}");
    assert!(!warnings.is_empty(), "{text}");
    assert!(warnings.iter().all(|line| line.starts_with("gramian: cube.xyz: ")), "{text}");
    assert!(warnings.iter().any(|line| line.contains(" of 488 points: ")), "{text}");
    // The column counts as the line does.
    let csv = String::from_utf8(folder.read("cube.csv")).unwrap();
    let mut lines = csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let at = lines.next().unwrap().iter().position(|name| *name == "flagged").unwrap();
    let n_flagged = lines.filter(|cells| cells[at] == "1").count();
    assert!(last.contains(&format!(", {n_flagged} flagged,")), "{text}");
    let quiet = folder.run(&["curvatures", "cube.xyz", "-o", "cube.csv", "--surface", "regression", "-q"]);
    assert_eq!((code(&quiet), told(&quiet)), (Some(0), String::new()));
}
