//! `knotmesh view`: a window in which patterns, meshes and settings are edited and the yarn follows.
//!
//! Data flows one way: edits -> [`State`] (undo goes back to it) -> fabric, made on a thread of its own -> a frame solved by a backend
//! that is kept -> strands -> a picture. All of that but the picture is a [`Session`], which knows of no window.

mod app;
mod ask;
mod chart_edit;
mod chart_view;
mod disk;
mod editor;
mod fabric;
mod history;
mod knit_view;
mod net;
#[doc(hidden)]
pub mod orbit;
mod panel;
mod play;
mod save;
#[doc(hidden)]
pub mod script;
mod session;
mod solver;
mod stage;
mod state;
mod window;

pub use disk::MeshReader;
pub use fabric::{Fabric, Seconds};
pub use session::{BLANK, Message, Options, Session};
pub use solver::Solver;
pub use state::{Content, Kind, Pull, Settings, State};
pub use window::{Launch, run};
