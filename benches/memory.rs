//! Memory and time by size: tubes of plain knit, welded, one frame from the table with one step.
//!
//! `cargo bench --bench memory [-- FACES...]`. Prints CSV. Bytes are those that the allocator was asked for. `held` is
//! what lives after the frame (scene, backend, output; the mesh and the frame's positions are gone), less the stitch
//! type's table, whose size does not depend on the mesh; what of it is held for each stitch, by field, is on standard
//! error.

#![allow(unsafe_code)]

use glam::DVec3;
use knotmesh::backend::{Backend, CpuBackend, FrameOutput, Running};
use knotmesh::ids::{TypeId, VertexId};
use knotmesh::knot::{Settings, Start};
use knotmesh::measure::machine::heading;
use knotmesh::mesh::{FaceEdge, Join, StitchMesh, StitchType};
use knotmesh::scene::{Scene, SceneOptions};
use knotmesh::template::TemplateLibrary;
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};
use std::time::Instant;

/// Stitches a round.
const COLUMNS: usize = 200;
/// Height of a course over its width.
const HEIGHT: f64 = 0.61;

/// Counts the bytes that live, and the most there were.
struct Counting;
static LIVE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

fn add(bytes: usize) {
    let live = LIVE.fetch_add(bytes, Relaxed) + bytes;
    PEAK.fetch_max(live, Relaxed);
}

// SAFETY: the system's allocator does the work.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        add(layout.size());
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        add(layout.size());
        // SAFETY: as the caller promises.
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(at, layout) }
    }
    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // The old block may live until the new one is filled; mostly it is grown where it stands.
        if size > layout.size() {
            add(size - layout.size());
        } else {
            LIVE.fetch_sub(layout.size() - size, Relaxed);
        }
        // SAFETY: as the caller promises.
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

fn live() -> usize {
    LIVE.load(Relaxed)
}

/// What lived most since this was last asked for.
fn peak() -> usize {
    PEAK.swap(live(), Relaxed)
}

/// A tube of whole rounds, vertices shared.
fn tube(faces: usize) -> StitchMesh {
    let rows = faces / COLUMNS;
    let radius = COLUMNS as f64 / std::f64::consts::TAU;
    let labels = ["-lX", "+yX", "+lX", "-yX"].map(String::from).to_vec();
    let mut mesh = StitchMesh {
        positions: Vec::with_capacity((rows + 1) * COLUMNS),
        face_offsets: (0..=faces as u32).map(|f| 4 * f).collect(),
        face_vertices: Vec::with_capacity(4 * faces),
        face_types: vec![TypeId(0); faces],
        types: vec![StitchType { name: "knit+".into(), labels }],
        joins: Vec::with_capacity(2 * faces),
        ..StitchMesh::default()
    };
    for k in 0..=rows {
        for i in 0..COLUMNS {
            let (sin, cos) = (std::f64::consts::TAU * i as f64 / COLUMNS as f64).sin_cos();
            mesh.positions.push(DVec3::new(radius * cos, radius * sin, k as f64 * HEIGHT));
        }
    }
    for k in 0..rows {
        for i in 0..COLUMNS {
            let next = (i + 1) % COLUMNS;
            let (face, right) = (k * COLUMNS + i, k * COLUMNS + next);
            let corners = [face, right, right + COLUMNS, face + COLUMNS];
            mesh.face_vertices.extend(corners.map(VertexId::from));
            let mut join = |edge, b: usize, edge_b| {
                let (a, b) =
                    (FaceEdge { face: face.into(), edge }, FaceEdge { face: b.into(), edge: edge_b });
                mesh.joins.push(Join { a, b, flipped: true });
            };
            join(1, right, 3);
            if k + 1 < rows {
                join(2, face + COLUMNS, 0);
            }
        }
    }
    mesh
}

fn main() {
    println!("{}", heading("memory"));
    // Cargo adds flags of its own.
    let mut sizes: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    if sizes.is_empty() {
        sizes = vec![1_000, 10_000, 100_000, 1_000_000, 10_000_000];
    }
    let library = TemplateLibrary::embedded();
    println!(
        "faces,mesh_bytes,scene_bytes,backend_bytes,output_bytes,table_bytes,held_bytes_per_stitch,\
         compile_peak_per_stitch,frame_peak_per_stitch,compile_ns_per_stitch,first_frame_ns_per_stitch,\
         frame_ns_per_stitch"
    );
    for faces in sizes {
        measure(faces, &library);
    }
}

fn measure(faces: usize, library: &TemplateLibrary) {
    let faces = faces / COLUMNS * COLUMNS;
    let each = |bytes: usize| bytes as f64 / faces as f64;
    let nanoseconds = |began: Instant| began.elapsed().as_secs_f64() * 1e9 / faces as f64;
    let begin = live();
    let mesh = tube(faces);
    let mesh_bytes = live() - begin;

    let before = live();
    peak();
    let began = Instant::now();
    let scene = Scene::compile(&mesh, library, SceneOptions::default()).expect("compiles");
    let compile_time = nanoseconds(began);
    let compile_peak = peak() - before;
    let scene = Arc::new(scene);
    let scene_bytes = live() - before;

    // Stretched, and otherwise in the second frame, so that nothing is skipped.
    let scaled = |scale| -> Vec<DVec3> { mesh.positions.iter().map(|p| *p * scale).collect() };
    let mut positions = scaled(DVec3::new(0.95, 0.95, 1.2));
    let again = scaled(DVec3::new(0.97, 0.97, 1.15));
    drop(mesh);
    let settings = Settings { start: Start::Table, iterations: 1, ..Settings::default() };
    let before = live();
    let running = Running { threads: 1, ..Running::default() };
    let mut backend = CpuBackend::<f32>::new(scene.clone(), &settings, &running).expect("in range");
    let mut output = FrameOutput::default();
    peak();
    let began = Instant::now();
    backend.frame(&positions, &mut output).expect("as many as vertices");
    let first_time = nanoseconds(began);
    let frame_peak = peak() - before;
    positions = again;
    let began = Instant::now();
    backend.frame(&positions, &mut output).expect("as many as vertices");
    let time = nanoseconds(began);
    assert_eq!(output.skipped.unmoved + output.skipped.rigid, 0, "{:?}", output.skipped);
    let after = live();
    let table: usize = backend.tables().reports.iter().map(|r| r.bytes).sum();
    by_field(&scene, &output, faces);
    drop(output);
    let output_bytes = after - live();
    let backend_bytes = after - before - output_bytes - table;
    let held = each(scene_bytes + backend_bytes + output_bytes);
    println!(
        "{faces},{mesh_bytes},{scene_bytes},{backend_bytes},{output_bytes},{table},{held:.1},{:.1},{:.1},{compile_time:.0},\
         {first_time:.0},{time:.0}",
        each(compile_peak),
        each(frame_peak)
    );
}

/// Bytes a stitch by field, of what can be seen from outside.
fn by_field(scene: &Scene, output: &FrameOutput<f32>, faces: usize) {
    let list =
        |name: &str, bytes: usize| eprintln!("{name}: {:.2} bytes a stitch", bytes as f64 / faces as f64);
    macro_rules! fields {
        ($($name:literal: $vec:expr),* $(,)?) => {
            $(list($name, $vec.capacity() * std::mem::size_of_val(&$vec[0]));)*
        };
    }
    let batch = &scene.batches[0];
    fields! {
        "scene, of the mesh, face_offsets": scene.face_offsets,
        "scene, of the mesh, face_vertices": scene.face_vertices,
        "scene, of the mesh, batch corners": batch.corners,
        "scene, batch faces": batch.faces,
        "scene, face_places": scene.face_places,
        "scene, strands": scene.yarns.strands,
        "scene, seams": scene.yarns.seams,
        "scene, yarn offsets": scene.yarns.offsets,
        "output, points": output.points,
        "output, knots": output.knots,
        "output, faces": output.faces,
    }
    if let Some(groups) = &scene.corner_groups {
        fields! {
            "scene, corner groups of vertices": groups.of_vertex,
            "scene, corner groups' offsets": groups.offsets,
            "scene, corner groups' faces": groups.faces,
        }
    }
}
