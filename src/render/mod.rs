//! Pictures of yarn: curves in, tubes drawn on the device, shaded as plied yarn or by numbers.
//!
//! Data flows [`Strands`] (what is drawn) + [`Camera`] + [`Look`] -> [`Painter`] -> [`Picture`]. A frame goes through passes, a file
//! each: points to yarn cross-sections (`prepare`), what is seen and how finely (`cull`), the light's view (`shadow`), depth, ambient
//! occlusion, shading, and development to 8 bits. What a pass needs of the ones before lies in `targets`, so that
//! passes of fibres and environment light can stand beside those of yarn.

pub mod camera;
pub mod colour;
mod dress;
pub mod fibre;
pub mod legend;
pub mod look;
mod painter;
mod parts;
mod passes;
mod picture;
mod strands;
pub mod style;
mod targets;
mod uniforms;
mod yarn;

pub use camera::{Camera, View};
pub use legend::Legend;
pub use look::{Background, Look, Shading};
pub use painter::Painter;
pub use picture::Picture;
pub use strands::Strands;
pub use style::Style;
pub use targets::Canvas;
pub use yarn::{Counts, Yarn};
