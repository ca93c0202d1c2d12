//! Files that answers are written to: replaced in one step, and never the one that is read.

use std::fs::{self, Permissions};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::process::Command;

use super::{Folder, code, sphere, told};
use crate::running::gramian;
use crate::support::LOOK_EVERY;
use crate::wire::limits::slow_request;

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
    // Among several clouds, neither may be the answer of the other.
    folder.write("a.xyz", &sphere(50));
    assert_eq!(code(&folder.run(&["normals", "a.xyz", "scan.ply", "-o", "./"])), Some(1));
    fs::remove_file(folder.0.join("a-normals.ply")).unwrap();
    fs::remove_file(folder.0.join("a.xyz")).unwrap();
    folder.write("request.json", "{}");
    assert_eq!(code(&folder.run(&["ask", "normals", "request.json", "-o", "request.json"])), Some(2));
    assert_eq!(folder.read("scan.ply"), b"ply\nthis is a scan\n");
    assert_eq!(folder.names(), ["hard.ply", "link.ply", "request.json", "scan.ply"]);
}

#[test]
fn what_cannot_be_written_is_told_before_anything_is_read() {
    let folder = Folder::new("unwritable");
    symlink("loop.ply", folder.0.join("loop.ply")).unwrap();
    for (output, part) in [
        ("no/such/out.ply", "no/such/out.ply: the folder does not exist"),
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
fn a_file_is_replaced_by_its_own_answer_only_if_that_is_forced() {
    let folder = Folder::new("force");
    folder.write("scan.xyz", &sphere(100));
    assert_eq!(code(&folder.run(&["normals", "scan.xyz", "-o", "scan.ply"])), Some(0));
    let before = folder.read("scan.ply");
    let refused = folder.run(&["curvatures", "scan.ply", "-o", "scan.ply"]);
    assert!(code(&refused) == Some(2) && told(&refused).contains("--force"), "{}", told(&refused));
    assert_eq!(folder.read("scan.ply"), before);
    assert_eq!(code(&folder.run(&["curvatures", "scan.ply", "-o", "scan.ply", "--force"])), Some(0));
    assert!(String::from_utf8_lossy(&folder.read("scan.ply")).contains("mean_curvature"));
}
