//! Real models and sequences, held against what another program held of them in memory. Needs `KNOTMESH_DATA`.

use crate::common::data;
use glam::DVec3;
use knotmesh::io::sequence::Sequence;
use knotmesh::io::{obj_mesh, strain_table, yarn_model};
use knotmesh::mesh::MaterialMesh;
use std::path::Path;

/// Model and number of vertices, nodes along each axis; counted without this reader.
const MODELS: [(&str, usize, usize); 8] = [
    ("model_basket_9", 80, 9),
    ("model_honey_9", 182, 9),
    ("model_rib_5", 356, 5),
    ("model_rib_9", 356, 9),
    ("model_satin_9", 130, 9),
    ("model_stock_5", 100, 5),
    ("model_stock_9", 100, 9),
    ("model_stocktiniest_9", 13, 9),
];

#[test]
#[cfg_attr(not(knotmesh_data), ignore = "KNOTMESH_DATA is not set")]
fn every_real_model_is_read() {
    let Some(data) = data() else { return };
    let folder = tempfile::tempdir().unwrap();
    for (name, vertices, nodes) in MODELS {
        let path = data.join("madypg/models").join(name);
        let model = yarn_model::read(&path).unwrap();
        assert_eq!(model.pattern.vertex_count(), vertices, "{name}");
        assert_eq!(model.table.axes().each_ref().map(Vec::len), [nodes; 3], "{name}");
        assert!(model.pattern.directors.iter().all(|d| (d.length() - 1.0).abs() < 1e-4), "{name}");
        // Rest lengths are near the distances between vertices.
        for edge in &model.pattern.edges {
            let [from, to] = [edge.from, edge.to].map(|v| model.pattern.places[v as usize]);
            let step = to - from + (model.pattern.size * edge.tile.as_dvec2()).extend(0.0);
            let stretch = step.length() / model.pattern.rest_lengths[edge.from as usize];
            assert!((0.9..1.1).contains(&stretch), "{name}: {edge:?} {stretch}");
        }
        // Bit for bit what another reader reads.
        let file = std::fs::File::open(path.join("sxsasy/data.npy")).unwrap();
        let values: Vec<f32> = npyz::NpyFile::new(file).unwrap().into_vec().unwrap();
        assert_eq!(values, *model.table.values().as_flattened(), "{name}");
        let [_, data] = strain_table::write(&model.table);
        let own = data.len() - size_of_val(&values[..]);
        let theirs = std::fs::read(path.join("sxsasy/data.npy")).unwrap();
        assert_eq!(data[own..], theirs[theirs.len() - (data.len() - own)..], "{name}");
        let npz = folder.path().join("m.npz");
        yarn_model::write_npz(&npz, &model).unwrap();
        assert_eq!(yarn_model::read(&npz).unwrap(), model, "{name}");
    }
}

/// Sequence and its number of frames, as its first bytes say.
const SEQUENCES: [(&str, usize); 17] = [
    ("basket_stretchX", 60),
    ("basket_stretchY", 60),
    ("honey_stretchX", 60),
    ("honey_stretchY", 60),
    ("rib_stretchX", 60),
    ("rib_stretchY", 60),
    ("satin_stretchX", 60),
    ("satin_stretchY", 60),
    ("shear_grid_x", 120),
    ("stock_stretchX", 60),
    ("stock_stretchY", 60),
    ("sx", 140),
    ("sxsy", 100),
    ("sxsy_const", 160),
    ("synth_roll", 41),
    ("synth_sleeve", 41),
    ("synth_twist", 41),
];

#[test]
#[cfg_attr(not(knotmesh_data), ignore = "KNOTMESH_DATA is not set")]
fn every_real_sequence_is_read() {
    let Some(data) = data() else { return };
    let folder = tempfile::tempdir().unwrap();
    for (name, frames) in SEQUENCES {
        let path = data.join("madypg/sequences").join(name).with_extension("bin");
        let mut sequence = Sequence::open(&path).unwrap();
        assert_eq!(sequence.len(), frames, "{name}");
        sequence.mesh().check().unwrap();
        let mesh = sequence.mesh().clone();
        let read = |frame: usize| {
            let mut positions = Vec::new();
            sequence.read(frame, &mut positions).map(|()| positions)
        };
        let all: Vec<Vec<DVec3>> = (0..frames).map(read).collect::<Result<_, _>>().unwrap();
        assert_eq!(all[0], mesh.positions, "{name}");
        assert!(all.iter().any(|positions| *positions != all[0]), "{name} moves");
        // Written again, it is the same to the byte: nothing in it was passed over.
        let again = folder.path().join("a.bin");
        knotmesh::io::sequence::write(&again, &mesh, all[1..].iter()).unwrap();
        assert!(std::fs::read(&again).unwrap() == std::fs::read(&path).unwrap(), "{name}");
    }
    let sx = data.join("madypg/sequences/sx.bin");
    assert_eq!(std::fs::metadata(sx).unwrap().len(), 11702);
}

fn array<T: npyz::Deserialize>(path: &Path, name: &str) -> Vec<T> {
    let mut archive = npyz::npz::NpzArchive::open(path).unwrap();
    archive.by_name(name).unwrap().unwrap().into_vec().unwrap()
}

/// Bit for bit the mesh that the reference values belong to.
fn assert_is_reference(mesh: &MaterialMesh, positions: &[DVec3], reference: &Path) {
    let name = reference.display();
    let singles = |numbers: Vec<f64>| numbers.into_iter().map(|x| x as f32).collect::<Vec<_>>();
    let own = singles(positions.iter().flat_map(|p| p.to_array()).collect());
    assert_eq!(own, array::<f32>(reference, "positions"), "{name}");
    let own = singles(mesh.uvs.iter().flat_map(|p| p.to_array()).collect());
    assert_eq!(own, array::<f32>(reference, "uv"), "{name}");
    assert_eq!(*mesh.faces.as_flattened(), array::<u32>(reference, "faces"), "{name}");
    assert_eq!(*mesh.face_uvs.as_flattened(), array::<u32>(reference, "faces_uv"), "{name}");
}

/// Seen red with F and Fms exchanged.
#[test]
#[cfg_attr(not(knotmesh_data), ignore = "KNOTMESH_DATA is not set")]
fn meshes_are_those_of_the_reference() {
    let Some(data) = data() else { return };
    let data = data.join("madypg");
    for (sequence, frame, reference) in [
        ("sxsy_const", 40, "sxsyconst_stock-040"),
        ("stock_stretchX", 59, "stock_stretchX-059"),
        ("rib_stretchX", 30, "rib_stretchX-030"),
        ("synth_twist", 40, "twist_stock-040"),
    ] {
        let path = data.join("sequences").join(sequence).with_extension("bin");
        let mut sequence = Sequence::open(&path).unwrap();
        let mut positions = Vec::new();
        sequence.read(frame, &mut positions).unwrap();
        let reference = data.join("reference").join(reference).with_extension("npz");
        assert_is_reference(sequence.mesh(), &positions, &reference);
    }
    let sock = obj_mesh::read_file(&data.join("objstatic/sock/cloth.obj")).unwrap();
    let sock = sock.into_material_mesh().unwrap();
    assert_eq!((sock.positions.len(), sock.uvs.len(), sock.faces.len()), (2409, 2552, 4772));
    assert_is_reference(&sock, &sock.positions, &data.join("reference/sock_rib-000.npz"));
}
