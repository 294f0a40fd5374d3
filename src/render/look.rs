//! What a picture looks like, beyond where it is taken from.

/// What colours are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Shading {
    /// The strands' own colours, as yarn.
    #[default]
    Yarn,
    /// The strands' own colours, plain: numbers that were turned to colours.
    Numbers,
    /// Length of each segment over its length at rest, from the first to the second.
    Tension([f32; 2]),
}

/// What is behind the yarn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Background {
    /// Nothing: the picture has an alpha channel.
    Transparent,
    /// Colours (sRGB) at the top and at the bottom.
    Gradient([u8; 3], [u8; 3]),
}

impl Background {
    /// Paper.
    pub const PAPER: Self = Self::Gradient([246, 244, 240], [222, 219, 214]);
}

/// Settings of pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// What colours are.
    pub shading: Shading,
    /// What is behind.
    pub background: Background,
    /// Samples a pixel: passes of 4 each, which also soften shadows and occlusion.
    pub samples: u32,
    /// Points and sides of what is drawn, as a factor: 1 keeps silhouettes within a quarter of a pixel.
    pub detail: f32,
    /// Whether yarn throws shadows.
    pub shadows: bool,
    /// Whether valleys are darker.
    pub occlusion: bool,
    /// Whether yarn that is stretched becomes thinner, and what is pressed together thicker: its volume is kept.
    pub keep_volume: bool,
    /// Plies and fibres; without, yarn is smooth.
    pub plies: bool,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            shading: Shading::Yarn,
            background: Background::PAPER,
            samples: 4,
            detail: 1.0,
            shadows: true,
            occlusion: true,
            keep_volume: true,
            plies: true,
        }
    }
}

impl Look {
    /// Samples a pixel with which moving yarn of a radius in pixels does not shimmer: its pixels flicker by about 2 steps of 255
    /// (`cargo bench --bench render -- shimmer`). At most 64.
    pub fn steady(radius: f64) -> u32 {
        let wanted = (32.0 / radius).clamp(1.0, 64.0).ceil() as u32;
        wanted.next_multiple_of(4)
    }
}
