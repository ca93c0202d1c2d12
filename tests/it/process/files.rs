//! Subcommands that answer files without a server.

use std::fs::{self, Permissions};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::PathBuf;
use std::process::{Command, Output};

use serde_json::{Value, json};

use crate::running::gramian;
use crate::support::{LOOK_EVERY, fibonacci_sphere};
use crate::wire::limits::slow_request;

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
        gramian().current_dir(&self.0).args(arguments).output().unwrap()
    }

    /// The names of all files, in order.
    fn names(&self) -> Vec<String> {
        let files = fs::read_dir(&self.0).unwrap();
        let mut names: Vec<String> =
            files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
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
        (["curvatures", "scan.xyz", "-o", "curvatures.ply", "--std"].as_slice(), "ply"),
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
fn an_answer_never_replaces_the_file_that_is_read() {
    let folder = Folder::new("same");
    folder.write("scan.ply", "ply\nthis is a scan\n");
    symlink("scan.ply", folder.0.join("link.ply")).unwrap();
    fs::hard_link(folder.0.join("scan.ply"), folder.0.join("hard.ply")).unwrap();
    for output in ["scan.ply", "./scan.ply", "link.ply", "hard.ply"] {
        let ended = folder.run(&["normals", "scan.ply", "-o", output]);
        let told = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(code(&ended), Some(2), "{output}: {told}");
        assert!(
            told.contains(&format!("{output}: the answer would replace the file that is read")),
            "{told}"
        );
    }
    folder.write("request.json", "{}");
    assert_eq!(code(&folder.run(&["ask", "normals", "request.json", "-o", "request.json"])), Some(2));
    assert_eq!(folder.read("scan.ply"), b"ply\nthis is a scan\n");
    assert_eq!(folder.names(), ["hard.ply", "link.ply", "request.json", "scan.ply"]);
}

#[test]
fn what_cannot_be_written_is_told_before_anything_is_read() {
    let folder = Folder::new("unwritable");
    fs::create_dir(folder.0.join("folder.ply")).unwrap();
    symlink("loop.ply", folder.0.join("loop.ply")).unwrap();
    for (output, part) in [
        ("no/such/out.ply", "no/such/out.ply: nothing can be written in its folder"),
        ("folder.ply", "folder.ply: is a directory"),
        ("loop.ply", "loop.ply"),
        ("/proc/out.ply", "/proc/out.ply"),
    ] {
        let ended = folder.run(&["normals", "absent.ply", "-o", output]);
        let told = String::from_utf8_lossy(&ended.stderr);
        assert_eq!(code(&ended), Some(1), "{output}: {told}");
        assert!(told.contains(part) && !told.contains("absent.ply"), "{told}");
    }
}

#[test]
fn a_full_disk_leaves_an_older_file_as_it_was() {
    let folder = Folder::new("full");
    folder.write("scan.xyz", &sphere(300));
    folder.write("out.ply", "older");
    // No file may grow beyond 1 KiB, and the signal that tells so is ignored: writes fail.
    let line = format!("ulimit -f 1; trap '' XFSZ; exec {} \"$@\"", env!("CARGO_BIN_EXE_gramian"));
    let mut command = Command::new("bash");
    command.args(["-c", &line, "bash", "normals", "scan.xyz", "-o", "out.ply"]);
    let ended = command.current_dir(&folder.0).output().unwrap();
    let told = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(code(&ended), Some(1), "{told}");
    assert!(told.contains("out.ply: File too large"), "{told}");
    assert_eq!(folder.read("out.ply"), b"older");
    assert_eq!(folder.names(), ["out.ply", "scan.xyz"]);
}

#[test]
fn an_interrupt_leaves_an_older_file_as_it_was() {
    for (signal, expected) in [("-INT", 130), ("-TERM", 143)] {
        let folder = Folder::new(&format!("interrupt{signal}"));
        folder.write("request.json", &slow_request().to_string());
        folder.write("out.json", "older");
        let mut command = gramian();
        let arguments = ["ask", "curvatures", "request.json", "-o", "out.json"];
        let mut child = command.current_dir(&folder.0).args(arguments).spawn().unwrap();
        // The file beside the output is there before the work begins.
        while folder.names().len() < 3 {
            assert!(child.try_wait().unwrap().is_none(), "{:?}", folder.names());
            std::thread::sleep(LOOK_EVERY);
        }
        let pid = child.id().to_string();
        assert!(Command::new("kill").args([signal, &pid]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(expected));
        assert_eq!(folder.read("out.json"), b"older");
        assert_eq!(folder.names(), ["out.json", "request.json"]);
    }
}

#[test]
fn a_replaced_file_keeps_its_permissions_and_its_links() {
    let folder = Folder::new("permissions");
    folder.write("scan.xyz", &sphere(100));
    folder.write("older.ply", "older");
    let older = folder.0.join("older.ply");
    fs::set_permissions(&older, Permissions::from_mode(0o640)).unwrap();
    fs::create_dir(folder.0.join("links")).unwrap();
    symlink("../older.ply", folder.0.join("links/out.ply")).unwrap();
    symlink("new.ply", folder.0.join("dangling.ply")).unwrap();
    for output in ["links/out.ply", "dangling.ply"] {
        assert_eq!(code(&folder.run(&["normals", "scan.xyz", "-o", output])), Some(0));
        assert!(folder.0.join(output).is_symlink());
    }
    assert!(folder.read("older.ply").starts_with(b"ply") && folder.read("new.ply").starts_with(b"ply"));
    let mode = |name: &str| fs::metadata(folder.0.join(name)).unwrap().permissions().mode() & 0o777;
    folder.write("other.ply", "as new files are");
    assert_eq!((mode("older.ply"), mode("new.ply")), (0o640, mode("other.ply")));
}

#[test]
fn pipes_take_answers_as_they_come() {
    let folder = Folder::new("pipe");
    folder.write("scan.xyz", &sphere(100));
    let pipe = folder.0.join("out.ply");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let mut command = gramian();
    command.current_dir(&folder.0).args(["normals", "scan.xyz", "-o", "out.ply"]);
    let mut child = command.spawn().unwrap();
    assert!(fs::read(&pipe).unwrap().starts_with(b"ply"));
    assert!(child.wait().unwrap().success());
    // A link to standard output stands for it.
    symlink("/dev/stdout", folder.0.join("standard.ply")).unwrap();
    let ended = folder.run(&["normals", "scan.xyz", "-o", "standard.ply"]);
    assert!(ended.stdout.starts_with(b"ply"), "{}", String::from_utf8_lossy(&ended.stderr));
    assert_eq!(folder.names(), ["out.ply", "scan.xyz", "standard.ply"]);
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
