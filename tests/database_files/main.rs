//! Files of the precomputed method: yarn models, sequences of cloth, meshes with material coordinates. Every rule, every
//! message with its place, the command, and real files.

#[path = "../common/mod.rs"]
mod common;
mod convert;
mod mesh;
mod model;
mod pyp;
mod real;
mod sequence;

use std::path::Path;

/// The message of a failed read, without the folder that the file is in.
fn message<T>(folder: &Path, result: knotmesh::Result<T>) -> String {
    match result {
        Ok(_) => "read without an error".into(),
        Err(error) => {
            let text = error.to_string();
            assert_eq!(text.lines().count(), 1, "{text}");
            text.replace(&format!("{}/", folder.display()), "")
        }
    }
}
