//! Each operation of lanes against the scalar's, on special values and random bits.
//!
//! Seeded faults in `Lanes`, each seen red: a negation as 0 - x, the greater one chosen the other way round (NaN, -0),
//! `le` as the opposite of the converse `lt` (NaN), a quotient as a product with the reciprocal, `any` blind to the last
//! lane.

use super::{bits, widths};
use crate::common::Random;
use knotmesh::math::{Real, Scalar, Wide, Width};

const SPECIAL: [f32; 24] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    -0.5,
    1.5,
    -2.5,
    3.0,
    1e-3,
    f32::EPSILON,
    f32::MIN_POSITIVE,
    -f32::MIN_POSITIVE,
    f32::from_bits(1),
    f32::from_bits(0x8000_0001),
    f32::from_bits(0x007f_ffff),
    4_194_303.5,
    -4_194_303.5,
    16_777_217.0,
    f32::MAX,
    f32::MIN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
];

/// Runs every operation on triples of numbers.
#[derive(Clone, Copy)]
struct Operations<'a>(&'a [[f32; 3]]);

/// What an operation gave of each triple.
type Results = Vec<(&'static str, Vec<u32>)>;

impl Wide<f32> for Operations<'_> {
    type Output = Results;

    #[inline(always)]
    fn run<R: Real<Scalar = f32>>(self) -> Results {
        let mut results = Results::new();
        let one = |mask| R::select(mask, R::one(), R::zero());
        macro_rules! operation {
            ($name:literal, |$x:ident, $y:ident, $z:ident| $value:expr) => {
                let mut out = Vec::new();
                for triples in self.0.chunks(R::LANES) {
                    let mut lanes = [R::default(); 3];
                    for (lane, triple) in triples.iter().enumerate() {
                        for (lanes, x) in lanes.iter_mut().zip(triple) {
                            lanes.set_lane(lane, *x);
                        }
                    }
                    let [$x, $y, $z] = lanes;
                    let _ = ($x, $y, $z);
                    let value = $value;
                    out.extend((0..triples.len()).map(|lane| bits(value.lane(lane))));
                }
                results.push(($name, out));
            };
        }
        operation!("add", |x, y, z| x + y);
        operation!("sub", |x, y, z| x - y);
        operation!("mul", |x, y, z| x * y);
        operation!("div", |x, y, z| x / y);
        operation!("neg", |x, y, z| -x);
        operation!("add_assign", |x, y, z| {
            let mut sum = x;
            sum += y;
            sum
        });
        operation!("sub_assign", |x, y, z| {
            let mut sum = x;
            sum -= y;
            sum
        });
        // Two operations, which no compiler may fuse.
        operation!("mul and add", |x, y, z| x * y + z);
        operation!("mul and sub", |x, y, z| x - y * z);
        operation!("sqrt", |x, y, z| x.sqrt());
        operation!("abs", |x, y, z| x.abs());
        operation!("min", |x, y, z| x.min(y));
        operation!("max", |x, y, z| x.max(y));
        operation!("lt", |x, y, z| one(x.lt(y)));
        operation!("le", |x, y, z| one(x.le(y)));
        operation!("finite", |x, y, z| one(x.finite()));
        operation!("select", |x, y, z| R::select(x.lt(y), y, z));
        operation!("and", |x, y, z| one(R::and(x.lt(y), y.lt(z))));
        operation!("or", |x, y, z| one(R::or(x.lt(y), y.lt(z))));
        operation!("not", |x, y, z| one(R::not(x.lt(y))));
        operation!("mask", |x, y, z| one(R::mask(true)) - one(R::mask(false)));
        operation!("mask_lane", |x, y, z| {
            let mut out = R::default();
            for lane in 0..R::LANES {
                out.set_lane(lane, f32::from(u8::from(R::mask_lane(x.lt(y), lane))));
            }
            out
        });
        operation!("floor", |x, y, z| x.floor());
        operation!("of", |x, y, z| R::of(0.1) + R::splat(0.1));
        let values: Vec<f32> = (0..100).map(|i| (i as f32).sqrt()).collect();
        operation!("gather of one", |x, y, z| R::gather(&values[..1], x));
        operation!("gather", |x, y, z| R::gather(&values, x));
        results
    }
}

/// For each of so many lanes, whether a mask that is set there alone is set anywhere.
struct Any;
impl Wide<f32> for Any {
    type Output = Vec<bool>;
    fn run<R: Real<Scalar = f32>>(self) -> Vec<bool> {
        let mut all = vec![!R::any(R::mask(false)), R::any(R::mask(true)), !R::any(R::Mask::default())];
        for lane in 0..R::LANES {
            let mut x = R::default();
            x.set_lane(lane, 1.0);
            let mask = R::zero().lt(x);
            all.push(R::any(mask));
            all.push((0..R::LANES).all(|i| R::mask_lane(mask, i) == (i == lane)));
        }
        all
    }
}

fn triples() -> Vec<[f32; 3]> {
    let mut triples = Vec::new();
    for x in SPECIAL {
        for y in SPECIAL {
            triples.extend(SPECIAL.map(|z| [x, y, z]));
        }
    }
    let mut random = Random::new(1);
    for i in 0..50_000 {
        triples.push(std::array::from_fn(|_| match i % 4 {
            // Any bits, numbers near 1, places in a table, and halves, whose rounding has ties.
            0 => f32::from_bits(random.bits() as u32),
            1 => random.between(-2.0, 2.0) as f32,
            2 => random.between(-10.0, 200.0) as f32,
            _ => (random.between(-1e3, 1e3) * 2.0).round() as f32 / 2.0,
        }));
    }
    triples
}

#[test]
fn operations_are_the_scalars_to_the_bit() {
    let triples = triples();
    let scalar = f32::widen(Width::One, Operations(&triples));
    for width in widths() {
        let lanes = f32::widen(width, Operations(&triples));
        let mut count = 0;
        for ((name, scalar), (_, lanes)) in scalar.iter().zip(&lanes) {
            assert_eq!(scalar.len(), lanes.len());
            for ((a, b), triple) in scalar.iter().zip(lanes).zip(&triples) {
                assert_eq!(
                    a,
                    b,
                    "{width:?}: {name} of {triple:?}: {} {}",
                    f32::from_bits(*a),
                    f32::from_bits(*b)
                );
                count += 1;
            }
        }
        println!("{width:?}: {count} values agree");
        assert!(f32::widen(width, Any).iter().all(|x| *x));
    }
}

/// The scalar itself: nothing fused, `floor` the standard library's, NaN as lanes and shaders treat it.
#[test]
fn the_scalar_is_what_it_says() {
    let triples = triples();
    let results = f32::widen(Width::One, Operations(&triples));
    let of = |name: &str| &results.iter().find(|(n, _)| *n == name).expect("an operation").1;
    let (neg, floor, product, gather) = (of("neg"), of("floor"), of("mul and add"), of("gather"));
    for (i, [x, y, z]) in triples.iter().enumerate() {
        assert_eq!(neg[i], bits(-x), "-{x}");
        let exact = f64::from(*x) * f64::from(*y);
        assert_eq!(product[i], bits(exact as f32 + z), "{x} * {y} + {z}");
        if x.abs() < 4_194_304.0 {
            assert_eq!(f32::from_bits(floor[i]), x.floor(), "floor of {x}");
        }
        let place = (*x as usize).min(99);
        assert_eq!(gather[i], (place as f32).sqrt().to_bits(), "place {x}");
    }
}
