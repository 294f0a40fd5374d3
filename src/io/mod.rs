//! Readers and writers, one file per format.

pub mod bcc;
pub mod convert;
pub mod curve_info;
pub mod curves;
mod embedded;
pub mod face_mask;
pub mod frames;
pub mod library;
pub mod mitsuba;
pub mod npy;
pub mod npz;
pub mod npz_read;
pub mod numbers;
pub mod obj_lines;
pub mod obj_mesh;
pub mod output;
pub mod pbrt;
pub mod result;
pub mod scan;
pub mod sf;
pub mod smobj;
pub mod template_json;
pub mod text;
pub mod usda;
pub mod usda_read;
pub mod yarns;
pub mod zip;
