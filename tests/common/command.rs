//! Running the command line.

use assert_cmd::Command;

/// Runs `knotmesh` in the project's folder: exit status, what it printed, and what it had to say.
pub fn knotmesh(arguments: &[&str]) -> (i32, String, String) {
    let mut command = Command::cargo_bin("knotmesh").expect("it was built");
    let output = command.current_dir(env!("CARGO_MANIFEST_DIR")).args(arguments).output().expect("it runs");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().expect("not killed by a signal"), text(&output.stdout), text(&output.stderr))
}
