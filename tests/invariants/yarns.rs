//! Invariants 5 and 9: continuity across faces, and the same bytes for any number of threads.

use crate::cases::case;
use crate::common::run::run;
use crate::{MODES, options, solve};
use knotmesh::backend::Precision;
use knotmesh::knot::Settings;
use knotmesh::mesh::Join;
use knotmesh::scene::{Mode, NO_SECOND_SLOT};
use knotmesh::template::TemplateLibrary;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Seeded faults: fractions not flipped when chaining (no point is shared any more); normals per face instead
/// of per corner group.
fn continuity<T: Precision>(seed: u64) {
    let (rest, mesh, _) = case(seed, 0.5);
    let library = TemplateLibrary::embedded();
    for mode in MODES {
        let run = solve::<T>(&mesh, &library, mode);
        let slots = run.backend.slots(&run.output);
        let tolerance = if std::mem::size_of::<T>() == 4 { 1e-5 } else { 1e-12 };
        let mut shared = 0;
        for [a, b] in run.scene.point_slots() {
            if *b != NO_SECOND_SLOT {
                let gap = (slots[*a as usize] - slots[*b as usize]).to_f64().length();
                assert!(gap < tolerance, "the two sides of a shared point lie {gap} apart");
                shared += 1;
            }
        }
        // Every join of these meshes carries one loop (two legs), two above a tuck, or one yarn.
        let carried = |join: &Join| match (join.a.edge, &rest.face_type(join.a.face).name[..4]) {
            (2, "tuck") => 4,
            (2, _) => 2,
            _ => 1,
        };
        let expected: usize = rest.joins.iter().map(carried).sum();
        assert_eq!(shared, expected);
        // Consecutive points of a yarn lie in one face: never further apart than the face is large.
        for yarn in 0..run.scene.yarns.len() {
            let range = run.scene.yarns.range(yarn);
            for i in range.start + 1..range.end {
                let step = (run.output.points[i] - run.output.points[i - 1]).to_f64().length();
                assert!(step < 10.0, "a yarn jumps by {step} course spacings");
            }
        }
    }
}

/// Seeded fault: normals summed in the order of a hash map.
fn threads<T: Precision>(seed: u64) {
    let (_, mesh, _) = case(seed, 0.5);
    let library = TemplateLibrary::embedded();
    let bits = |threads| {
        let run = run::<T>(&mesh, &library, options(Mode::Relax), &Settings::default(), threads);
        let points = run.output.points.iter().map(|p| p.to_f64().to_array().map(f64::to_bits));
        let energies = run.output.faces.iter().map(|f| f.energy.to_f64().to_bits());
        (points.collect::<Vec<_>>(), energies.collect::<Vec<_>>())
    };
    let one = bits(1);
    assert_eq!(one, bits(2));
    assert_eq!(one, bits(5));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    #[test]
    fn yarns_are_continuous_across_faces(seed: u64) {
        continuity::<f64>(seed);
        continuity::<f32>(seed);
    }

    #[test]
    fn threads_do_not_change_a_bit(seed: u64) {
        threads::<f64>(seed);
        threads::<f32>(seed);
    }
}

/// Also beyond one chunk of work: 3,000 faces.
#[test]
fn threads_do_not_change_a_bit_of_a_large_mesh() {
    use crate::common::grid::{Wrap, grid, placed, tube_place};
    let mesh = grid(60, 50, Wrap::Helix, false, |_, _| "knit+ -lX +yX +lX -yX".into());
    let mut mesh = placed(mesh, 60, tube_place(60, true));
    crate::cases::deform(&mut mesh, 0.3, &mut crate::common::Random::new(1));
    let library = TemplateLibrary::embedded();
    let points = |threads| {
        run::<f32>(&mesh, &library, options(Mode::Relax), &Settings::default(), threads).output.points
    };
    let one = points(1);
    assert!(one == points(2) && one == points(3));
}

#[test]
fn closed_rows_come_out_closed_and_a_helix_is_one_yarn() {
    use crate::common::grid::{Wrap, grid, placed, tube_place};
    let library = TemplateLibrary::embedded();
    for wrap in [Wrap::Tube, Wrap::Helix, Wrap::Torus] {
        let (columns, rows) = (8, 5);
        let mesh = grid(columns, rows, wrap, false, |_, _| "knit+ -lX +yX +lX -yX".into());
        let mesh = placed(mesh, columns, tube_place(columns, wrap == Wrap::Helix));
        let yarns = solve::<f64>(&mesh, &library, Mode::Relax).scene.yarns.clone();
        let closed = yarns.closed.iter().filter(|c| **c).count();
        match wrap {
            // The lowest round's loops hang from nothing: each is a yarn of its own below.
            Wrap::Tube => assert_eq!((closed, yarns.len()), (rows - 1, rows - 1 + columns * 2)),
            Wrap::Torus => assert_eq!((closed, yarns.len()), (rows, rows)),
            _ => assert_eq!(closed, 0),
        }
    }
}
