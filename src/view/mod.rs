//! `knotmesh view`: a window in which patterns, meshes and settings are edited and the yarn follows.
//!
//! Data flows one way: edits -> [`State`] (undo goes back to it) -> fabric, made on a thread of its own -> a frame solved by a backend
//! that is kept -> strands -> a picture. All of that but the picture is a [`Session`], which knows of no window.

mod disk;
mod fabric;
mod history;
mod net;
mod save;
mod session;
mod solver;
mod state;

pub use disk::MeshReader;
pub use fabric::{Fabric, Seconds};
pub use session::{BLANK, Message, Options, Session};
pub use solver::Solver;
pub use state::{Content, Kind, Pull, Settings, State};
