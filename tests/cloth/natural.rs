//! What neighbours make of a stitch's size.

use super::{HEIGHT, WIDTH, cloth, fabric, options, sample};
use crate::grid::Wrap;
use glam::DVec3;
use knotmesh::cloth::{Factors, Front, RelaxOptions, SpringKind, relax};
use knotmesh::mesh::StitchMesh;

const COLUMNS: usize = 24;
const ROWS: usize = 20;

/// Mean width and height of stitches in the middle of relaxed fabric, in those of plain ones.
fn relaxed(knit: impl Fn(usize, usize) -> bool) -> (f64, f64) {
    let mesh = fabric(COLUMNS, ROWS, Wrap::Flat, knit);
    let cloth = cloth(&mesh, &options());
    let mut nodes = cloth.rest_positions().to_vec();
    assert!(relax(&cloth, &mut nodes, &RelaxOptions::default()).unwrap().converged);
    let mut mesh = mesh;
    cloth.write_back(&nodes, &mut mesh.positions);
    sizes(&mesh)
}

fn sizes(mesh: &StitchMesh) -> (f64, f64) {
    let corner =
        |column: usize, row: usize| mesh.positions[mesh.face((row * COLUMNS + column).into())[0].index()];
    let (width, height) = (corner(4, 10).distance(corner(20, 10)), corner(12, 4).distance(corner(12, 16)));
    (width / (16.0 * WIDTH), height / (12.0 * HEIGHT))
}

/// Seen red with `differs` that never says so, with width and height of the table swapped, and with a 1x1 rib narrower than a 2x2.
#[test]
fn ribs_draw_in_and_garter_shortens() {
    let stockinette = relaxed(|_, _| true);
    let purls = relaxed(|_, _| false);
    let rib_1 = relaxed(|_, i| i % 2 == 0);
    let rib_2 = relaxed(|_, i| i % 4 < 2);
    let rib_5 = relaxed(|_, i| i % 10 < 5);
    let garter = relaxed(|k, _| k % 2 == 0);
    let seed = relaxed(|k, i| (k + i) % 2 == 0);
    let near = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).abs() < 0.02 && (a.1 - b.1).abs() < 0.02;
    assert!(near(stockinette, (1.0, 1.0)) && near(purls, (1.0, 1.0)), "{stockinette:?} {purls:?}");
    let f = Factors::default();
    assert!(near(rib_1, (f.width[2][0], f.height[2][0])), "{rib_1:?}");
    assert!(near(rib_2, (f.width[1][0], f.height[1][0])), "{rib_2:?}");
    assert!(near(garter, (f.width[0][2], f.height[0][2])), "{garter:?}");
    assert!(near(seed, (f.width[2][2], f.height[2][2])), "{seed:?}");
    assert!(rib_2.0 < rib_1.0 && rib_2.0 < rib_5.0 && rib_5.0 < 0.95, "{rib_1:?} {rib_2:?} {rib_5:?}");
    assert!(rib_1.0 < seed.0 && seed.0 < garter.0 && garter.0 > 1.0, "{rib_1:?} {seed:?} {garter:?}");
    assert!(garter.1 < seed.1 && seed.1 < 1.0, "{garter:?} {seed:?}");
}

/// Seen red with borders that keep the plain height beside garter.
#[test]
fn borders_follow_what_they_border() {
    let cloth = cloth(&sample("garter.smobj"), &options());
    let heights = cloth.springs().iter().filter(|s| s.kind == SpringKind::Wale && s.nodes[0] != s.nodes[1]);
    let (low, high) =
        heights.fold((f64::MAX, 0.0_f64), |(low, high), s| (low.min(s.length), high.max(s.length)));
    // The turn at the side spans two rows; a row of garter is 0.7 high, that beside the cast-on 0.85.
    assert!(low > 0.65 * HEIGHT && high < 2.0 * 0.87 * HEIGHT, "{low} {high}");
    let nodes = cloth.rest_positions();
    assert!(nodes.iter().all(|p| p.is_finite()));
}

/// Seen red with names compared whole (`knit+` was neutral).
#[test]
fn fronts_by_name() {
    for (name, front) in [
        ("knit+", Front::Knit),
        ("knit-twisted-", Front::Knit),
        ("decrease-right+", Front::Knit),
        ("make-left-tuck-twist-", Front::Knit),
        ("purl-", Front::Purl),
        ("purl-decrease-left+", Front::Purl),
        ("purltuck+", Front::Purl),
        ("tuck-twist+", Front::Neutral),
        ("slip+", Front::Neutral),
        ("edge(", Front::Neutral),
        ("over", Front::Neutral),
    ] {
        assert_eq!(Front::of_name(name), front, "{name}");
    }
    assert!(
        Front::Knit.differs(Front::Purl)
            && !Front::Knit.differs(Front::Knit)
            && !Front::Neutral.differs(Front::Purl)
    );
}

/// Seen red with factors of types that are not used.
#[test]
fn sizes_by_gauge_and_type() {
    let mesh = fabric(6, 6, Wrap::Flat, |_, _| true);
    let mut options = options();
    options.sizes = Some(knotmesh::cloth::Sizes::of_gauge(20.0, 40.0));
    options.types.insert("knit+".into(), [1.25, 0.5]);
    let cloth = cloth(&mesh, &options);
    for s in cloth.springs() {
        let want = match s.kind {
            SpringKind::Course => 0.005 * 1.25,
            SpringKind::Wale => 0.0025 * 0.5,
            SpringKind::Shear => f64::hypot(0.005 * 1.25, 0.0025 * 0.5),
        };
        assert!((s.length - want).abs() < 1e-12, "{s:?}, {want}");
    }
}

/// A decrease of the embedded library: five edges, and each bottom corner tied to each top one. Seen red with a pentagon that
/// has the diagonals within its bottom and top instead.
#[test]
fn pentagons_tie_bottom_to_top() {
    let mesh = sample("lace.smobj");
    let cloth = cloth(&mesh, &options());
    let face =
        (0..mesh.face_count()).find(|f| mesh.face_type((*f).into()).name == "decrease-right+").unwrap();
    let corner = |k: usize| cloth.node_of_vertex()[mesh.face(face.into())[k].index()];
    let tied = |a: usize, b: usize| {
        let [a, b] = [corner(a).min(corner(b)), corner(a).max(corner(b))];
        cloth.springs().iter().any(|s| s.kind == SpringKind::Shear && s.nodes == [a, b])
    };
    assert!(tied(0, 3) && tied(1, 3) && tied(1, 4) && tied(2, 4) && !tied(0, 2));
}

/// The mass of plain fabric is its area's. Seen red with masses of drawn-in areas.
#[test]
fn mass_is_yarn() {
    let sum = |knit: fn(usize, usize) -> bool| {
        cloth(&fabric(10, 8, Wrap::Flat, knit), &options()).masses().iter().sum::<f64>()
    };
    let want = options().density * 80.0 * WIDTH * HEIGHT;
    assert!((sum(|_, _| true) / want - 1.0).abs() < 1e-12);
    assert!((sum(|_, i| i % 2 == 0) / want - 1.0).abs() < 1e-12);
}

/// Vertices that are one place are one node, whichever way the mesh says so. Seen red with `write_back` of the next node.
#[test]
fn welded_or_not() {
    let apart = fabric(5, 4, Wrap::Flat, |_, i| i % 2 == 0);
    let cloth = cloth(&apart, &options());
    assert_eq!(cloth.node_count(), 30);
    let mut vertices = vec![DVec3::ZERO; apart.positions.len()];
    cloth.write_back(cloth.rest_positions(), &mut vertices);
    let off = vertices.iter().zip(&apart.positions).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
    assert!(off < 1e-12, "{off}");
    assert_eq!(cloth.nodes_of(&apart.positions).unwrap(), cloth.rest_positions());
    assert!(cloth.nodes_of(&apart.positions[1..]).is_err());
}
