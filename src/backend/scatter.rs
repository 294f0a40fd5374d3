//! Writing from many threads into one slice, each element from one place.

#![allow(unsafe_code)]

use std::marker::PhantomData;

/// A slice whose elements are written from several threads at once.
pub struct Scatter<'a, T> {
    first: *mut T,
    len: usize,
    slice: PhantomData<&'a mut [T]>,
}

// SAFETY: elements are plain data, and `write` demands that no two threads write one.
unsafe impl<T: Send> Sync for Scatter<'_, T> {}
// SAFETY: as above.
unsafe impl<T: Send> Send for Scatter<'_, T> {}

impl<'a, T: Copy> Scatter<'a, T> {
    pub fn new(slice: &'a mut [T]) -> Self {
        Self { first: slice.as_mut_ptr(), len: slice.len(), slice: PhantomData }
    }

    /// Where `count` elements begin, all of them within the slice; written to as [`Scatter::write`] demands.
    #[inline(always)]
    pub fn begin(&self, at: usize, count: usize) -> *mut T {
        assert!(at <= self.len && count <= self.len - at);
        // SAFETY: within the slice.
        unsafe { self.first.add(at) }
    }

    /// Writes an element.
    ///
    /// # Safety
    /// While this lives, no other thread writes the same element.
    #[inline(always)]
    pub unsafe fn write(&self, at: usize, value: T) {
        assert!(at < self.len);
        // SAFETY: within the slice, which is borrowed for as long as this lives; the caller sees to the rest.
        unsafe { self.first.add(at).write(value) };
    }
}
