//! Yarn models: folders and `.npz`.

use super::message;
use crate::common::{database, npy::npy};
use knotmesh::io::{pyp, strain_table, yarn_model};
use knotmesh::pattern::{StrainTable, YarnModel};
use npyz::WriterBuilder;
use std::path::Path;

/// Equal to the bit, zeros of either sign told apart.
fn assert_same(a: &YarnModel, b: &YarnModel) {
    assert_eq!(a.pattern, b.pattern);
    let bits = |table: &StrainTable| -> Vec<u32> {
        table.axes().iter().flatten().chain(table.values().iter().flatten()).map(|x| x.to_bits()).collect()
    };
    assert_eq!(bits(&a.table), bits(&b.table));
    assert_eq!(a.table.axes().each_ref().map(Vec::len), b.table.axes().each_ref().map(Vec::len));
}

fn odd_model() -> YarnModel {
    let model = database::model([4, 3, 5]);
    let mut values = model.table.values().to_vec();
    values[0] = [-0.0, f32::MIN_POSITIVE / 2.0, f32::MAX, 0.1];
    YarnModel::new(model.pattern, StrainTable::new(model.table.axes().clone(), values).unwrap()).unwrap()
}

#[test]
fn the_made_up_model_is_one() {
    let model = database::model([3, 3, 3]);
    assert_eq!((model.pattern.vertex_count(), model.table.node_count()), (12, 27));
    let links = model.pattern.links().unwrap();
    for vertex in 0..12 {
        let edge = model.pattern.edges[links.leaving[vertex] as usize];
        let step = model.pattern.places[edge.to as usize] - model.pattern.places[vertex]
            + (model.pattern.size * edge.tile.as_dvec2()).extend(0.0);
        assert!((step.length() - model.pattern.rest_lengths[vertex]).abs() < 1e-15, "{vertex}");
        assert!(step.dot(model.pattern.directors[vertex]).abs() < 1e-15, "{vertex}");
        assert!((model.pattern.directors[vertex].length() - 1.0).abs() < 1e-12);
    }
    // Index by index, as the table says that its values lie.
    let [x, a, y] = odd_model().table.axes().each_ref().map(Vec::len);
    let (vertex, iy, ia, ix) = (7, 4, 1, 2);
    let at = ix + x * (ia + a * (iy + y * vertex));
    let axes = database::axes([x, a, y]);
    let strain = [axes[0][ix], axes[1][ia], axes[2][iy]].map(f64::from);
    let expected = database::displacement(vertex, strain).map(|x| x as f32);
    assert_eq!(odd_model().table.values()[at], expected);
}

/// Seen red with sx and sy exchanged in the `.npz`.
#[test]
fn models_round_trip_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let (dir, npz, again) = (folder.path().join("m"), folder.path().join("m.npz"), folder.path().join("n"));
    let model = odd_model();
    yarn_model::write_dir(&dir, &model).unwrap();
    assert_same(&yarn_model::read(&dir).unwrap(), &model);
    yarn_model::write_npz(&npz, &yarn_model::read(&dir).unwrap()).unwrap();
    assert_same(&yarn_model::read(&npz).unwrap(), &model);
    yarn_model::write_dir(&again, &yarn_model::read(&npz).unwrap()).unwrap();
    for name in ["pyp", "sxsasy/axes.txt", "sxsasy/data.npy"] {
        assert_eq!(
            std::fs::read(dir.join(name)).unwrap(),
            std::fs::read(again.join(name)).unwrap(),
            "{name}"
        );
    }
    // A folder is not written over, and nothing is left beside it.
    let error = message(folder.path(), yarn_model::write_dir(&dir, &model));
    assert_eq!(error, "m: is there already, expected a new name");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let plain = folder.path().join("plain");
        std::fs::create_dir(&plain).unwrap();
        let mode = |path: &Path| path.metadata().unwrap().permissions().mode();
        assert_eq!(mode(&dir), mode(&plain));
    }
}

/// The arrays as another reader sees them.
#[test]
fn the_archive_holds_what_its_docs_say() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.npz");
    let model = odd_model();
    yarn_model::write_npz(&path, &model).unwrap();
    let mut archive = npyz::npz::NpzArchive::open(&path).unwrap();
    let shapes = yarn_model::ARRAYS.map(|name| {
        let array = archive.by_name(name).unwrap().expect(name);
        format!("{name} {:?} {}", array.shape(), array.dtype().descr())
    });
    assert_eq!(
        shapes,
        [
            "pattern_size [2] '<f8'",
            "radius [] '<f8'",
            "places [12, 3] '<f8'",
            "twists [12] '<f8'",
            "edges [12, 2] '<u4'",
            "edge_tiles [12, 2] '<i4'",
            "rest_lengths [12] '<f8'",
            "directors [12, 3] '<f8'",
            "axis_sx [4] '<f4'",
            "axis_sa [3] '<f4'",
            "axis_sy [5] '<f4'",
            "displacements [12, 5, 3, 4, 4] '<f4'",
        ]
    );
    let values: Vec<f32> = archive.by_name("displacements").unwrap().unwrap().into_vec().unwrap();
    assert_eq!(values, *model.table.values().as_flattened());
    let edges: Vec<u32> = archive.by_name("edges").unwrap().unwrap().into_vec().unwrap();
    assert_eq!(edges[..4], [5, 0, 6, 7]);
}

/// An archive of the model's arrays as f64, compressed, one of them changed.
fn archive(path: &Path, model: &YarnModel, changed: &str, shape: &[u64], numbers: &[f64]) {
    let (pattern, table) = (&model.pattern, &model.table);
    let vectors = |list: &[glam::DVec3]| list.iter().flat_map(|p| p.to_array()).collect::<Vec<_>>();
    let axis =
        |k: usize| (vec![table.axes()[k].len() as u64], table.axes()[k].iter().map(|x| *x as f64).collect());
    let n = pattern.vertex_count() as u64;
    let [sx, sa, sy] = table.axes().each_ref().map(|axis| axis.len() as u64);
    let edges = &pattern.edges;
    let arrays: [(Vec<u64>, Vec<f64>); 12] = [
        (vec![2], pattern.size.to_array().to_vec()),
        (vec![], vec![pattern.radius]),
        (vec![n, 3], vectors(&pattern.places)),
        (vec![n], pattern.twists.clone()),
        (vec![n, 2], edges.iter().flat_map(|e| [e.from as f64, e.to as f64]).collect()),
        (vec![n, 2], edges.iter().flat_map(|e| e.tile.as_dvec2().to_array()).collect()),
        (vec![n], pattern.rest_lengths.clone()),
        (vec![n, 3], vectors(&pattern.directors)),
        axis(0),
        axis(1),
        axis(2),
        (vec![n, sy, sa, sx, 4], table.values().iter().flatten().map(|x| *x as f64).collect()),
    ];
    let mut writer = npyz::npz::NpzWriter::create(path).unwrap();
    for (name, (own_shape, own)) in yarn_model::ARRAYS.iter().zip(arrays) {
        let (shape, numbers) = if *name == changed { (shape, numbers) } else { (&own_shape[..], &own[..]) };
        if *name == changed && numbers.is_empty() {
            continue;
        }
        let builder = writer.array(name, Default::default()).unwrap().default_dtype().shape(shape);
        let mut array = builder.begin_nd().unwrap();
        array.extend(numbers.iter().copied()).unwrap();
        array.finish().unwrap();
    }
    let builder = writer.array("of_another_name", Default::default()).unwrap().default_dtype().shape(&[1]);
    let mut array = builder.begin_nd().unwrap();
    array.extend([1.0f64]).unwrap();
    array.finish().unwrap();
}

#[test]
fn archives_of_others_are_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m.npz");
    let model = odd_model();
    archive(&path, &model, "", &[], &[]);
    assert_same(&yarn_model::read(&path).unwrap(), &model);
    let edges: Vec<f64> = model.pattern.edges.iter().flat_map(|e| [e.from as f64, e.to as f64]).collect();
    let with = |at: usize, x: f64| {
        let mut edges = edges.clone();
        edges[at] = x;
        edges
    };
    // The array, its shape and numbers; how the message ends, after the entry's place where there is one.
    let cases: Vec<(&str, Vec<u64>, Vec<f64>, &str)> = vec![
        (
            "radius",
            vec![1],
            vec![1.0],
            "found the shape [1] in 8 bytes of 'radius.npy', expected [], and as many bytes",
        ),
        (
            "radius",
            vec![],
            vec![-1.0],
            "found a pattern of 0.012 x 0.008 with yarn of radius -1, expected positive numbers",
        ),
        ("twists", vec![11], vec![0.0; 11], "expected [12], and as many bytes"),
        (
            "places",
            vec![0, 3],
            vec![],
            "found no array 'places', expected a yarn model, with pattern_size, radius",
        ),
        ("edges", vec![12, 2], with(3, 12.0), "edge 1: found vertex 12, expected one below 12"),
        (
            "edges",
            vec![12, 2],
            with(3, 0.5),
            "found 0.5 in row 1 of 'edges', expected a whole number of 32 bits",
        ),
        (
            "edges",
            vec![12, 2],
            with(2, -1.0),
            "found -1 in row 1 of 'edges', expected a whole number of 32 bits",
        ),
        (
            "edges",
            vec![12, 2],
            with(2, 5.0),
            "edge 1: found that it leaves vertex 5 as edge 0 does, expected one edge",
        ),
        (
            "edge_tiles",
            vec![12, 2],
            vec![f64::NAN; 24],
            "found NaN in row 0 of 'edge_tiles', expected a whole number",
        ),
        (
            "rest_lengths",
            vec![12],
            vec![0.0; 12],
            "vertex 0: found a rest length of 0, expected a positive number",
        ),
        (
            "axis_sa",
            vec![3],
            vec![0.0, 1.0, 1.0],
            "axis sa: found nodes that do not rise, expected rising ones",
        ),
        ("axis_sa", vec![33], vec![0.0; 33], "of 'axis_sa.npy', expected [1 to 32], and as many bytes"),
        (
            "axis_sa",
            vec![2],
            vec![0.0, 1.0],
            "of 'displacements.npy', expected [12, 5, 2, 4, 4], and as many bytes",
        ),
        (
            "displacements",
            vec![12, 5, 3, 4, 4],
            vec![1e300; 12 * 240],
            "displacement 0: found a number that is not finite, expected finite ones",
        ),
    ];
    for (name, shape, numbers, expected) in cases {
        archive(&path, &model, name, &shape, &numbers);
        let error = message(folder.path(), yarn_model::read(&path));
        assert!(error.starts_with("m.npz:") && error.contains(expected), "{name}: {error}");
    }
}

#[test]
fn tables_of_other_shapes() {
    let folder = tempfile::tempdir().unwrap();
    let table = odd_model().table;
    let [axes, data] = strain_table::write(&table);
    let place = |name: &str| folder.path().join(name);
    std::fs::write(place("axes.txt"), &axes).unwrap();
    std::fs::write(place("data.npy"), &data).unwrap();
    assert_eq!(strain_table::read(folder.path()).unwrap(), table);
    let numbers = table.values().as_flattened();
    let singles: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    let doubles: Vec<u8> = numbers.iter().flat_map(|x| (*x as f64).to_be_bytes()).collect();
    for good in [npy("<f4", false, &[12, 5, 3, 4, 4], &singles), npy(">f8", false, &[720, 4], &doubles)] {
        std::fs::write(place("data.npy"), good).unwrap();
        assert_eq!(strain_table::read(folder.path()).unwrap(), table);
    }
    let mut poisoned = singles.clone();
    poisoned[4 * 5..4 * 6].copy_from_slice(&f32::NAN.to_le_bytes());
    let offset = npy("<f4", false, &[720, 4], &[]).len();
    let end = offset + singles.len();
    for (bytes, expected) in [
        (
            npy("<f4", true, &[720, 4], &singles),
            "data.npy:1:1: found numbers of kind 'f' in Fortran order, expected floats in C order",
        ),
        (
            npy("<i4", false, &[720, 4], &singles),
            "data.npy:1:1: found numbers of kind 'i' in C order, expected floats in C order",
        ),
        (
            npy("<f4", false, &[721, 4], &singles),
            "data.npy:1:1: found an array of shape [721, 4], expected [vertex * 60, 4] or [vertex, 5, 3, 4, 4] as the axes have nodes",
        ),
        (
            npy("<f4", false, &[12, 4, 3, 5, 4], &singles),
            "data.npy:1:1: found an array of shape [12, 4, 3, 5, 4], expected [vertex * 60, 4] or [vertex, 5, 3, 4, 4] as the axes have nodes",
        ),
        (
            npy("<f4", false, &[0, 4], &[]),
            "data.npy:1:1: found an array of shape [0, 4], expected [vertex * 60, 4] or [vertex, 5, 3, 4, 4] as the axes have nodes",
        ),
        (
            npy("<f4", false, &[18446744073709551600, 4], &singles),
            &format!(
                "data.npy:1:{}: found 11520 bytes of numbers, expected as many as the shape [18446744073709551600, 4] has",
                offset + 11521
            ),
        ),
        (
            npy("<f4", false, &[720, 4], &singles[1..]),
            &format!(
                "data.npy:1:{end}: found 11519 bytes of numbers, expected as many as the shape [720, 4] has"
            ),
        ),
        (
            npy("<f4", false, &[720, 4], &poisoned),
            &format!("data.npy:1:{}: found NaN in row 1, expected a finite displacement", offset + 21),
        ),
        (b"no array".to_vec(), "data.npy:1:1: found another kind of file, expected a NumPy array (.npy)"),
    ] {
        std::fs::write(place("data.npy"), bytes).unwrap();
        assert_eq!(message(folder.path(), strain_table::read(folder.path())), expected);
    }
}

#[test]
fn axes_that_are_none() {
    let read = |text: &str| strain_table::read_axes(Path::new("in"), text.as_bytes());
    let axes = read("-1 0.1 2 # sx\n\n0\r\n3e-1 5\n\n").unwrap();
    assert_eq!(axes, [vec![-1.0, 0.1, 2.0], vec![0.0], vec![0.3, 5.0]]);
    let many: String = (0..33).map(|i| format!("{i} ")).collect();
    for (text, expected) in [
        ("", "in:1:1: found the end of the file, expected a line with the nodes of sx"),
        ("0\n1\n", "in:2:1: found the end of the file, expected a line with the nodes of sy"),
        ("0\n1\n2\n\n 3", "in:5:2: found '3', expected three lines: sx, sa and sy"),
        ("0 x\n1\n2", "in:1:3: found 'x', expected a node of sx, a finite number"),
        ("0\n1 inf\n2", "in:2:3: found 'inf', expected a node of sa, a finite number"),
        ("0\n1\n2 1e39", "in:3:3: found '1e39', expected a node of sy, a finite number"),
        ("0\n1 2 2\n2", "in:2:5: found '2', expected a node of sa above 2.0"),
        ("0\n1 0\n2", "in:2:3: found '0', expected a node of sa above 1.0"),
        (&many, "in:1:87: found '32', expected at most 32 nodes of sx"),
    ] {
        assert_eq!(message(Path::new("."), read(text)), expected, "{text}");
    }
}

#[test]
fn folders_that_are_no_models() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("m");
    let read = || message(folder.path(), yarn_model::read(&path));
    assert!(read().starts_with("m: No such file"), "{}", read());
    yarn_model::write_dir(&path, &database::model([3, 3, 3])).unwrap();
    assert!(yarn_model::read(&path).is_ok());
    // The table is of twelve vertices, the pattern of the first yarn's six.
    let mut pattern = database::pattern();
    pattern.edges.retain(|e| e.from < 6);
    pattern.places.truncate(6);
    pattern.twists.truncate(6);
    pattern.rest_lengths.truncate(6);
    pattern.directors.truncate(6);
    std::fs::write(path.join("pyp"), pyp::write(&pattern)).unwrap();
    assert_eq!(read(), "m/sxsasy/data.npy:1:1: found displacements of 12 vertices, expected 6 as 'pyp' has");
    std::fs::write(path.join("pyp"), "*pattern\n0\n").unwrap();
    assert!(read().starts_with("m/pyp:2:2: found the end of the line"), "{}", read());
    std::fs::remove_file(path.join("pyp")).unwrap();
    assert!(read().starts_with("m/pyp: No such file"), "{}", read());
    let other = folder.path().join("m.txt");
    std::fs::write(&other, "").unwrap();
    let error = message(folder.path(), yarn_model::read(&other));
    assert!(error.starts_with("m.txt: found another kind of file, expected a yarn model"), "{error}");
}
