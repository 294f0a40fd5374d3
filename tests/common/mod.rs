//! Meshes and helpers that several tests share.
#![allow(dead_code)]

pub mod command;
pub mod curves;
pub mod database;
pub mod fabric;
pub mod faces;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod grid;
pub mod memory;
pub mod npy;
pub mod run;

/// A small generator of random numbers (xorshift), so that a seed names a case.
pub struct Random(pub u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        let mut random = Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        (0..8).for_each(|_| {
            random.bits();
        });
        random
    }
    pub fn bits(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }
    /// In 0..1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
    pub fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }
    pub fn shuffled(&mut self, n: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..n).collect();
        for i in (1..n).rev() {
            order.swap(i, self.below(i + 1));
        }
        order
    }
}

/// The folder with real files, or `None` after saying that the test is skipped.
pub fn data() -> Option<std::path::PathBuf> {
    match std::env::var_os("KNOTMESH_DATA") {
        Some(path) => Some(path.into()),
        None => {
            println!("skipped: KNOTMESH_DATA is not set");
            None
        }
    }
}
