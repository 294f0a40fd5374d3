//! Mesh, library and frame files: every rule, every message with its place, and real files.

mod frames;
mod obj;
mod real;
mod sf;
mod smobj;

use knotmesh::Result;
use std::path::Path;

/// What files are called in messages here.
fn path() -> &'static Path {
    Path::new("in")
}

/// The message of a failed read.
fn message<T>(result: Result<T>) -> String {
    match result {
        Ok(_) => "read without an error".into(),
        Err(error) => error.to_string(),
    }
}
