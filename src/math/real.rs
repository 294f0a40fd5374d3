//! The scalar that the kernels are written over.

use super::lanes::{Wide, Width};
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number, or several side by side: f64 is the reference, f32 the twin of SIMD lanes and GPU
/// threads. Kernels use nothing but + - × / sqrt, min, max and selection by masks, in one order, so that
/// every instance of the same precision gives the same bits. No operation is fused.
pub trait Real:
    Copy
    + Debug
    + Default
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
{
    /// The result of a comparison.
    type Mask: Copy + Debug + Default + Send + Sync;
    /// One of the numbers side by side.
    type Scalar: Scalar;

    /// How many numbers stand side by side.
    const LANES: usize;

    /// Energies at or below this are zero to rounding: the stitch is at rest.
    const REST_ENERGY: f64;
    /// A solve has converged when a step lowers the energy by less than this share of it, ...
    const CONVERGED: f64;
    /// ... and this much: what a step of about 1e-4 r changes, in f32.
    const CONVERGED_BELOW: f64;

    /// Rounds to this precision.
    fn of(x: f64) -> Self;
    /// The same number in every lane.
    fn splat(x: Self::Scalar) -> Self;
    /// The number in a lane.
    fn lane(&self, lane: usize) -> Self::Scalar;
    /// Puts a number into a lane.
    fn set_lane(&mut self, lane: usize, value: Self::Scalar);
    /// The first numbers of a slice, side by side.
    #[inline(always)]
    fn load(from: &[Self::Scalar]) -> Self {
        let mut out = Self::default();
        let from = &from[..Self::LANES];
        for (lane, value) in from.iter().enumerate() {
            out.set_lane(lane, *value);
        }
        out
    }
    /// Puts them into the first places of a slice.
    #[inline(always)]
    fn store(self, to: &mut [Self::Scalar]) {
        let to = &mut to[..Self::LANES];
        for (lane, value) in to.iter_mut().enumerate() {
            *value = self.lane(lane);
        }
    }
    /// Square root.
    fn sqrt(self) -> Self;
    /// Absolute value.
    fn abs(self) -> Self;
    /// The smaller one.
    fn min(self, other: Self) -> Self;
    /// The larger one.
    fn max(self, other: Self) -> Self;
    /// self < other; false for NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// self <= other; false for NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// Neither infinite nor NaN.
    fn finite(self) -> Self::Mask;
    /// `yes` where the mask is set, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Both.
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// Either.
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// The opposite.
    fn not(a: Self::Mask) -> Self::Mask;
    /// A mask that is the same everywhere.
    fn mask(value: bool) -> Self::Mask;
    /// Whether the mask is set anywhere.
    fn any(mask: Self::Mask) -> bool;
    /// Whether the mask is set in a lane.
    fn mask_lane(mask: Self::Mask, lane: usize) -> bool;

    /// The values at places given as whole numbers, each clamped to the slice; NaN counts as 0.
    #[inline(always)]
    fn gather(values: &[Self::Scalar], places: Self) -> Self {
        let mut out = Self::default();
        for lane in 0..Self::LANES {
            let place = places.lane(lane).to_f64() as usize;
            out.set_lane(lane, values[place.min(values.len() - 1)]);
        }
        out
    }
    /// The largest whole number not above; for magnitudes below 2^22.
    #[inline(always)]
    fn floor(self) -> Self {
        // So far from 0 there are whole numbers only.
        let far = Self::of(Self::Scalar::ONLY_WHOLE);
        let nearest = (self + far) - far;
        nearest - Self::select(self.lt(nearest), Self::one(), Self::zero())
    }

    /// 0.
    #[inline(always)]
    fn zero() -> Self {
        Self::of(0.0)
    }
    /// 1.
    #[inline(always)]
    fn one() -> Self {
        Self::of(1.0)
    }
}

/// A single number.
pub trait Scalar: Real<Scalar = Self, Mask = bool> + PartialEq + PartialOrd + bytemuck::Pod {
    /// 1.5 times the power of two beyond which numbers have no fraction.
    const ONLY_WHOLE: f64;
    /// The number as f64 (exact).
    fn to_f64(self) -> f64;
    /// Runs work in lanes.
    fn widen<W: Wide<Self>>(width: Width, work: W) -> W::Output;
}

impl Scalar for f64 {
    const ONLY_WHOLE: f64 = 1.5 * (1u64 << 52) as f64;
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
    fn widen<W: Wide<f64>>(_: Width, work: W) -> W::Output {
        work.run::<f64>()
    }
}

impl Scalar for f32 {
    const ONLY_WHOLE: f64 = 1.5 * (1u64 << 23) as f64;
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self.into()
    }
    fn widen<W: Wide<f32>>(width: Width, work: W) -> W::Output {
        super::lanes::dispatch(width, work)
    }
}

macro_rules! scalar {
    ($t:ty, $rest:expr, $converged:expr) => {
        impl Real for $t {
            type Mask = bool;
            type Scalar = $t;
            const LANES: usize = 1;
            const REST_ENERGY: f64 = $rest;
            const CONVERGED: f64 = $converged.0;
            const CONVERGED_BELOW: f64 = $converged.1;

            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn splat(x: $t) -> Self {
                x
            }
            #[inline(always)]
            fn lane(&self, _: usize) -> $t {
                *self
            }
            #[inline(always)]
            fn set_lane(&mut self, _: usize, value: $t) {
                *self = value;
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$t>::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                <$t>::abs(self)
            }
            // Written out, for the standard library's treat NaN otherwise than lanes and shaders do.
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn lt(self, other: Self) -> bool {
                self < other
            }
            #[inline(always)]
            fn le(self, other: Self) -> bool {
                self <= other
            }
            #[inline(always)]
            fn finite(self) -> bool {
                self.is_finite()
            }
            #[inline(always)]
            fn select(mask: bool, yes: Self, no: Self) -> Self {
                if mask { yes } else { no }
            }
            #[inline(always)]
            fn and(a: bool, b: bool) -> bool {
                a & b
            }
            #[inline(always)]
            fn or(a: bool, b: bool) -> bool {
                a | b
            }
            #[inline(always)]
            fn not(a: bool) -> bool {
                !a
            }
            #[inline(always)]
            fn mask(value: bool) -> bool {
                value
            }
            #[inline(always)]
            fn any(mask: bool) -> bool {
                mask
            }
            #[inline(always)]
            fn mask_lane(mask: bool, _: usize) -> bool {
                mask
            }
        }
    };
}

// Rounding leaves about (27 residuals) x 100 x (a few units in the last place)^2 behind.
scalar!(f64, 1e-26, (1e-10, 0.0));
// In f32 steps that change less than 1e-6 of E are rounding. Of ten times that, a Newton step leaves an error of
// some 1e-4 r.
scalar!(f32, 1e-10, (1e-5, 1e-8));
