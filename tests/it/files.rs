//! Subcommands that answer files without a server.

use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::{Value, json};

use crate::support::fibonacci_sphere;

/// A folder that is removed with its files.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("gramian-files-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.join(name), text).unwrap();
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.0.join(name)).unwrap()
    }

    /// Runs the binary in the folder, without the settings of this process.
    fn run(&self, arguments: &[&str]) -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gramian"));
        for (name, _) in std::env::vars().filter(|(name, _)| name.starts_with("GRAMIAN_")) {
            command.env_remove(name);
        }
        command.current_dir(&self.0).args(arguments).output().unwrap()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn sphere(n: usize) -> String {
    let rows = fibonacci_sphere(n).into_iter().map(|[x, y, z]| format!("{x} {y} {z}\n"));
    rows.collect()
}

fn code(output: &Output) -> Option<i32> {
    output.status.code()
}

#[test]
fn a_scan_becomes_curvatures_normals_and_a_mesh() {
    let folder = Folder::new("scan");
    folder.write("scan.xyz", &sphere(300));
    for (arguments, begins) in [
        (["curvatures", "scan.xyz", "-o", "curvatures.ply", "--deviations"].as_slice(), "ply"),
        (&["normals", "scan.xyz", "-o", "normals.json"], "{"),
        (&["mesh", "scan.xyz", "-o", "scan.glb"], "glTF"),
        (&["mesh", "scan.xyz", "-o", "scan.obj", "--with", r#"{"quality": "raw"}"#], "v "),
        // What was written can be read.
        (&["normals", "curvatures.ply", "-o", "again.ply"], "ply"),
    ] {
        let output = folder.run(arguments);
        assert_eq!((code(&output), output.stderr.as_slice()), (Some(0), &b""[..]), "{arguments:?}");
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
fn scripts_can_tell_what_went_wrong() {
    let folder = Folder::new("wrong");
    folder.write("twice.csv", "x,y\n0,0\n0,0\n1,0\n0,1\n");
    folder.write("text.xyz", "0 0 0\n0 0 zero\n");
    folder.write("half.json", "{");
    let cases = [
        (["normals", "absent.ply", "-o", "out.ply"].as_slice(), 1, "absent.ply"),
        (&["normals", "twice.csv", "-o", "out.docx"], 2, ".glb"),
        (&["normals", "twice.csv", "-o", "out.ply", "--with", "{"], 2, "--with"),
        (&["normals", "text.xyz", "-o", "out.ply"], 1, "line 2"),
        (&["normals", "twice.csv"], 2, "--output"),
        (&["mesh", "twice.csv", "-o", "out.ply", "--with", r#"{"step": -1}"#], 3, "/step"),
        (&["ask", "interpolation", "half.json"], 3, "JSON"),
        (&["ask", "no-such-thing", "half.json"], 3, "404"),
    ];
    for (arguments, expected, part) in cases {
        let output = folder.run(arguments);
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(code(&output), Some(expected), "{arguments:?}: {told}");
        assert!(told.contains(part), "{arguments:?}: {told}");
        assert!(!folder.0.join("out.ply").exists());
    }
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
