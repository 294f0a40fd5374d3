//! Numbers side by side: f32 lanes over the processor's vector registers, chosen at run time.
//!
//! Every lane computes what the scalar f32 does, in the same order and without fusing, so results are the same
//! bits for any width.

use super::{Real, Scalar};
use bytemuck::Zeroable;
use pulp::{Simd, WithSimd};
use std::fmt;
use std::marker::PhantomData;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// How many stitches are worked on side by side in f32. Results do not depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Width {
    /// What the processor does best.
    #[default]
    Auto,
    /// One at a time.
    One,
    /// Eight, where there is AVX2; else as many as there are.
    Eight,
    /// Sixteen, where there is AVX-512; else as many as there are.
    Sixteen,
}

/// Work that is written over [`Real`] and run over lanes of `T`.
pub trait Wide<T: Scalar> {
    /// What it gives.
    type Output;
    /// Runs over `R`.
    fn run<R: Real<Scalar = T>>(self) -> Self::Output;
}

/// An instruction set whose presence was checked before any of its lanes were made.
pub trait Instructions: Simd {
    /// The token; only lanes ask for it, and those run only inside [`Wide::run`].
    fn token() -> Self;
}

#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
mod x86 {
    use super::Instructions;
    use pulp::x86::{V3, V4};

    impl Instructions for V3 {
        #[inline(always)]
        fn token() -> Self {
            // SAFETY: `dispatch` names lanes of V3 only after detection.
            unsafe { Self::new_unchecked() }
        }
    }
    impl Instructions for V4 {
        #[inline(always)]
        fn token() -> Self {
            // SAFETY: `dispatch` names lanes of V4 only after detection.
            unsafe { Self::new_unchecked() }
        }
    }
}

#[cfg(target_arch = "aarch64")]
#[allow(unsafe_code)]
impl Instructions for pulp::aarch64::Neon {
    #[inline(always)]
    fn token() -> Self {
        // SAFETY: `dispatch` names lanes of Neon only after detection.
        unsafe { Self::new_unchecked() }
    }
}

/// Runs work in lanes of f32 of a width, with the best instructions there are for it.
pub(super) fn dispatch<W: Wide<f32>>(width: Width, work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        use pulp::x86::{V3, V4};
        if matches!(width, Width::Auto | Width::Sixteen)
            && let Some(v4) = V4::try_new()
        {
            return Simd::vectorize(v4, Op::<W, V4>(work, PhantomData));
        }
        if width != Width::One
            && let Some(v3) = V3::try_new()
        {
            return Simd::vectorize(v3, Op::<W, V3>(work, PhantomData));
        }
    }
    #[cfg(target_arch = "aarch64")]
    if width != Width::One
        && let Some(neon) = pulp::aarch64::Neon::try_new()
    {
        return Simd::vectorize(neon, Op::<W, pulp::aarch64::Neon>(work, PhantomData));
    }
    let _ = width;
    work.run::<f32>()
}

/// Work on its way through [`Simd::vectorize`].
struct Op<W, S>(W, PhantomData<S>);

impl<W: Wide<f32>, I: Instructions> WithSimd for Op<W, I> {
    type Output = W::Output;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> W::Output {
        self.0.run::<Lanes<I>>()
    }
}

/// Numbers side by side, as many as a register of `S` holds.
pub struct Lanes<S: Simd>(S::f32s);

/// A yes or no for each lane.
pub struct LaneMask<S: Simd>(S::m32s);

impl<S: Simd> Clone for Lanes<S> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}
impl<S: Simd> Copy for Lanes<S> {}
impl<S: Simd> Clone for LaneMask<S> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}
impl<S: Simd> Copy for LaneMask<S> {}
impl<S: Simd> fmt::Debug for Lanes<S> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_list().entries(self.as_slice()).finish()
    }
}
impl<S: Simd> fmt::Debug for LaneMask<S> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        self.0.fmt(f)
    }
}
impl<S: Simd> Default for Lanes<S> {
    #[inline(always)]
    fn default() -> Self {
        Self(Zeroable::zeroed())
    }
}
impl<S: Simd> Default for LaneMask<S> {
    #[inline(always)]
    fn default() -> Self {
        Self(Zeroable::zeroed())
    }
}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    fn as_slice(&self) -> &[f32] {
        bytemuck::cast_slice(std::slice::from_ref(&self.0))
    }
    #[inline(always)]
    fn as_mut_slice(&mut self) -> &mut [f32] {
        bytemuck::cast_slice_mut(std::slice::from_mut(&mut self.0))
    }
}

macro_rules! operator {
    ($trait:ident, $name:ident, $op:ident) => {
        impl<S: Instructions> $trait for Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(S::token().$op(self.0, other.0))
            }
        }
    };
}
operator!(Add, add, add_f32s);
operator!(Sub, sub, sub_f32s);
operator!(Mul, mul, mul_f32s);
operator!(Div, div, div_f32s);

impl<S: Instructions> Neg for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::splat(-0.0) - self
    }
}
impl<S: Instructions> AddAssign for Lanes<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
impl<S: Instructions> SubAssign for Lanes<S> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<S: Instructions> Real for Lanes<S> {
    type Mask = LaneMask<S>;
    type Scalar = f32;
    const LANES: usize = S::F32_LANES;
    const REST_ENERGY: f64 = f32::REST_ENERGY;
    const CONVERGED: f64 = f32::CONVERGED;
    const CONVERGED_BELOW: f64 = f32::CONVERGED_BELOW;

    #[inline(always)]
    fn of(x: f64) -> Self {
        Self::splat(x as f32)
    }
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self(S::token().splat_f32s(x))
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> f32 {
        self.as_slice()[lane]
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, value: f32) {
        self.as_mut_slice()[lane] = value;
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        let mut out = Self::default();
        out.as_mut_slice().copy_from_slice(&from[..S::F32_LANES]);
        out
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        to[..S::F32_LANES].copy_from_slice(self.as_slice());
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(S::token().sqrt_f32s(self.0))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(S::token().abs_f32s(self.0))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> LaneMask<S> {
        LaneMask(S::token().less_than_f32s(self.0, other.0))
    }
    #[inline(always)]
    fn le(self, other: Self) -> LaneMask<S> {
        LaneMask(S::token().less_than_or_equal_f32s(self.0, other.0))
    }
    #[inline(always)]
    fn finite(self) -> LaneMask<S> {
        self.abs().lt(Self::splat(f32::INFINITY))
    }
    #[inline(always)]
    fn select(mask: LaneMask<S>, yes: Self, no: Self) -> Self {
        Self(S::token().select_f32s(mask.0, yes.0, no.0))
    }
    #[inline(always)]
    fn and(a: LaneMask<S>, b: LaneMask<S>) -> LaneMask<S> {
        LaneMask(S::token().and_m32s(a.0, b.0))
    }
    #[inline(always)]
    fn or(a: LaneMask<S>, b: LaneMask<S>) -> LaneMask<S> {
        LaneMask(S::token().or_m32s(a.0, b.0))
    }
    #[inline(always)]
    fn not(a: LaneMask<S>) -> LaneMask<S> {
        LaneMask(S::token().not_m32s(a.0))
    }
    #[inline(always)]
    fn mask(value: bool) -> LaneMask<S> {
        if value { Self::zero().le(Self::zero()) } else { LaneMask::default() }
    }
    #[inline(always)]
    fn any(mask: LaneMask<S>) -> bool {
        S::token().first_true_m32s(mask.0) < S::F32_LANES
    }
    #[inline(always)]
    fn mask_lane(mask: LaneMask<S>, lane: usize) -> bool {
        Self::select(mask, Self::one(), Self::zero()).lane(lane) != 0.0
    }
}
