//! Numbers of a scene that are checked where they stand.

use glam::DVec3;
use serde::de::{Deserialize, Deserializer, Error, Unexpected};

/// Greatest magnitude of any number in a scene: beyond it, squares and products would leave the range of f64, and nobody means it.
const MOST: f64 = 1e9;

fn number<'de, D: Deserializer<'de>>(
    from: D,
    expected: &str,
    fine: impl Fn(f64) -> bool,
) -> Result<f64, D::Error> {
    let x = f64::deserialize(from)?;
    if x.abs() <= MOST && fine(x) {
        Ok(x)
    } else {
        Err(D::Error::invalid_value(Unexpected::Float(x), &expected))
    }
}

/// Above 0.
#[derive(Clone, Copy)]
pub struct Above(pub f64);

impl<'de> Deserialize<'de> for Above {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        number(from, "a number above 0, at least 1e-9 and at most 1e9", |x| x >= 1e-9).map(Self)
    }
}

/// 0 or above.
#[derive(Clone, Copy)]
pub struct AtLeastZero(pub f64);

impl<'de> Deserialize<'de> for AtLeastZero {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        number(from, "a number from 0 to 1e9", |x| x >= 0.0).map(Self)
    }
}

/// Any number that is not huge.
#[derive(Clone, Copy, Default)]
pub struct Number(pub f64);

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        number(from, "a number from -1e9 to 1e9", |_| true).map(Self)
    }
}

/// A whole number from 1 to `MOST`.
#[derive(Clone, Copy)]
pub struct Count<const MOST: u32>(pub u32);

impl<'de, const MOST: u32> Deserialize<'de> for Count<MOST> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let n = u64::deserialize(from)?;
        match u32::try_from(n) {
            Ok(small) if small >= 1 && small <= MOST => Ok(Self(small)),
            _ => Err(D::Error::invalid_value(
                Unexpected::Unsigned(n),
                &format!("a whole number from 1 to {MOST}").as_str(),
            )),
        }
    }
}

/// A point or a vector.
#[derive(Clone, Copy)]
pub struct Vector(pub DVec3);

impl<'de> Deserialize<'de> for Vector {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let [x, y, z] = <[Number; 3]>::deserialize(from)?;
        Ok(Self(DVec3::new(x.0, y.0, z.0)))
    }
}

/// A vector with a direction: not shorter than 1e-9. Normalised.
#[derive(Clone, Copy)]
pub struct Direction(pub DVec3);

impl<'de> Deserialize<'de> for Direction {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let v = Vector::deserialize(from)?.0;
        if v.length() >= 1e-9 {
            Ok(Self(v.normalize()))
        } else {
            Err(D::Error::invalid_value(
                Unexpected::Other("a vector without a direction"),
                &"one longer than 1e-9",
            ))
        }
    }
}

/// Factors along x, y and z: three numbers, or one for all.
#[derive(Clone, Copy)]
pub struct Factors(pub DVec3);

impl<'de> Deserialize<'de> for Factors {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl<'de> serde::de::Visitor<'de> for Visitor {
            type Value = Factors;
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("a factor, or three: [x, y, z], each above 0")
            }
            fn visit_f64<E: Error>(self, x: f64) -> Result<Factors, E> {
                if (1e-6..=1e6).contains(&x) {
                    Ok(Factors(DVec3::splat(x)))
                } else {
                    Err(E::invalid_value(Unexpected::Float(x), &"a factor from 1e-6 to 1e6"))
                }
            }
            fn visit_u64<E: Error>(self, x: u64) -> Result<Factors, E> {
                self.visit_f64(x as f64)
            }
            fn visit_i64<E: Error>(self, x: i64) -> Result<Factors, E> {
                self.visit_f64(x as f64)
            }
            fn visit_seq<A: serde::de::SeqAccess<'de>>(self, mut seq: A) -> Result<Factors, A::Error> {
                let mut all = [0.0; 3];
                for (k, x) in all.iter_mut().enumerate() {
                    let factor: Factors = seq
                        .next_element_seed(One)?
                        .ok_or_else(|| A::Error::invalid_length(k, &"three factors"))?;
                    *x = factor.0.x;
                }
                if seq.next_element::<serde::de::IgnoredAny>()?.is_some() {
                    return Err(A::Error::invalid_length(4, &"three factors"));
                }
                Ok(Factors(DVec3::from_array(all)))
            }
        }
        /// A factor that is no list.
        struct One;
        impl<'de> serde::de::DeserializeSeed<'de> for One {
            type Value = Factors;
            fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<Factors, D::Error> {
                let x = f64::deserialize(from)?;
                serde::de::Visitor::visit_f64(Visitor, x)
            }
        }
        from.deserialize_any(Visitor)
    }
}
