//! Vectors over [`Real`]; glam's are tied to one scalar and cannot be lanes.

use super::{Real, Scalar};
use std::ops::{Add, Mul, Neg, Sub};

/// A vector in the plane of a face.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct V2<T> {
    /// Along the course.
    pub u: T,
    /// Along the wale.
    pub v: T,
}

/// A vector in space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct V3<T> {
    /// First coordinate.
    pub x: T,
    /// Second coordinate.
    pub y: T,
    /// Third coordinate.
    pub z: T,
}

impl<T: Real> V2<T> {
    /// (u, v).
    #[inline(always)]
    pub fn new(u: T, v: T) -> Self {
        Self { u, v }
    }
    /// Rounds to this precision.
    pub fn of(p: glam::DVec2) -> Self {
        Self::new(T::of(p.x), T::of(p.y))
    }
    /// The same vector in every lane.
    #[inline(always)]
    pub fn splat(p: V2<T::Scalar>) -> Self {
        Self::new(T::splat(p.u), T::splat(p.v))
    }
    /// The vector in a lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> V2<T::Scalar> {
        V2 { u: self.u.lane(lane), v: self.v.lane(lane) }
    }
    /// Puts a vector into a lane.
    #[inline(always)]
    pub fn set_lane(&mut self, lane: usize, p: V2<T::Scalar>) {
        self.u.set_lane(lane, p.u);
        self.v.set_lane(lane, p.v);
    }
    /// The zero vector.
    #[inline(always)]
    pub fn zero() -> Self {
        Self::new(T::zero(), T::zero())
    }
    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> T {
        self.u * o.u + self.v * o.v
    }
    /// Turned by a quarter, counter-clockwise.
    #[inline(always)]
    pub fn turned(self) -> Self {
        Self::new(-self.v, self.u)
    }
    /// Component-wise selection.
    #[inline(always)]
    pub fn select(mask: T::Mask, yes: Self, no: Self) -> Self {
        Self::new(T::select(mask, yes.u, no.u), T::select(mask, yes.v, no.v))
    }
}

impl<T: Real> V3<T> {
    /// (x, y, z).
    #[inline(always)]
    pub fn new(x: T, y: T, z: T) -> Self {
        Self { x, y, z }
    }
    /// Rounds to this precision.
    pub fn of(p: glam::DVec3) -> Self {
        Self::new(T::of(p.x), T::of(p.y), T::of(p.z))
    }
    /// The vector in a lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> V3<T::Scalar> {
        V3 { x: self.x.lane(lane), y: self.y.lane(lane), z: self.z.lane(lane) }
    }
    /// Puts a vector into a lane.
    #[inline(always)]
    pub fn set_lane(&mut self, lane: usize, p: V3<T::Scalar>) {
        self.x.set_lane(lane, p.x);
        self.y.set_lane(lane, p.y);
        self.z.set_lane(lane, p.z);
    }
    /// The zero vector.
    #[inline(always)]
    pub fn zero() -> Self {
        Self::new(T::zero(), T::zero(), T::zero())
    }
    /// Scalar product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> T {
        self.x * o.x + self.y * o.y + self.z * o.z
    }
    /// Vector product.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        Self::new(self.y * o.z - self.z * o.y, self.z * o.x - self.x * o.z, self.x * o.y - self.y * o.x)
    }
    /// Euclidean length.
    #[inline(always)]
    pub fn length(self) -> T {
        self.dot(self).sqrt()
    }
    /// Where all three are neither infinite nor NaN.
    #[inline(always)]
    pub fn finite(self) -> T::Mask {
        T::and(T::and(self.x.finite(), self.y.finite()), self.z.finite())
    }
    /// Component-wise selection.
    #[inline(always)]
    pub fn select(mask: T::Mask, yes: Self, no: Self) -> Self {
        Self::new(T::select(mask, yes.x, no.x), T::select(mask, yes.y, no.y), T::select(mask, yes.z, no.z))
    }
    /// The direction; zero where the vector is zero or not finite.
    #[inline(always)]
    pub fn normalized_or_zero(self) -> Self {
        let length = self.length();
        let usable = T::and(T::zero().lt(length), length.finite());
        let scale = T::one() / T::select(usable, length, T::one());
        Self::select(usable, self * scale, Self::zero())
    }
}

impl<T: Scalar> V3<T> {
    /// The vector in f64 (exact).
    pub fn to_f64(self) -> glam::DVec3 {
        glam::DVec3::new(self.x.to_f64(), self.y.to_f64(), self.z.to_f64())
    }
}

impl<T: Real> Add for V2<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.u + o.u, self.v + o.v)
    }
}
impl<T: Real> Sub for V2<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.u - o.u, self.v - o.v)
    }
}
impl<T: Real> Neg for V2<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.u, -self.v)
    }
}
impl<T: Real> Mul<T> for V2<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: T) -> Self {
        Self::new(self.u * s, self.v * s)
    }
}
impl<T: Real> Add for V3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}
impl<T: Real> Sub for V3<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}
impl<T: Real> Mul<T> for V3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, s: T) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }
}
