//! What is told apart on the account.

/// What is counted: operations, bytes read from buffers, bytes written to them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Sums, differences, products, quotients and square roots of f32.
    Operations,
    /// The stitch type's words.
    Stencil,
    /// Places and normals.
    Surface,
    /// Where a face's corners and points are.
    Topology,
    /// Lists of faces to be worked on.
    Lists,
    /// The stitch type's table.
    Table,
    /// Knots of an earlier frame.
    KnotsRead,
    /// Results of an earlier frame.
    ResultsRead,
    /// Control points and sides of seams, where they are read.
    PointsRead,
    /// Remembered shapes.
    ShapesRead,
    /// Shapes whose solve is known, with it.
    Known,
    /// Where yarns begin.
    Yarns,
    /// Control points.
    Points,
    /// Knots.
    Knots,
    /// Results.
    Results,
    /// Areas and normals, and which of them changed.
    SurfaceWritten,
    /// Lists of faces to be worked on, put together.
    ListsWritten,
    /// Shapes to be remembered.
    Shapes,
    /// Samples of curves.
    Curves,
}

impl Kind {
    /// How many there are.
    pub const COUNT: usize = Self::ALL.len();
    /// All of them, in order.
    pub const ALL: [Self; 19] = [
        Self::Operations,
        Self::Stencil,
        Self::Surface,
        Self::Topology,
        Self::Lists,
        Self::Table,
        Self::KnotsRead,
        Self::ResultsRead,
        Self::PointsRead,
        Self::ShapesRead,
        Self::Known,
        Self::Yarns,
        Self::Points,
        Self::Knots,
        Self::Results,
        Self::SurfaceWritten,
        Self::ListsWritten,
        Self::Shapes,
        Self::Curves,
    ];

    /// Bytes of a shader's buffer, by its name.
    pub(in crate::backend::gpu) fn of(buffer: &str, written: bool) -> Option<Self> {
        Some(match (buffer, written) {
            ("stencil", false) => Self::Stencil,
            ("surface", false) => Self::Surface,
            ("topology", false) => Self::Topology,
            ("lists", false) => Self::Lists,
            ("table", false) => Self::Table,
            ("knots", false) => Self::KnotsRead,
            ("results", false) => Self::ResultsRead,
            ("points", false) => Self::PointsRead,
            ("shapes", false) => Self::ShapesRead,
            ("known", false) => Self::Known,
            ("yarns", false) => Self::Yarns,
            ("points", true) => Self::Points,
            ("knots", true) => Self::Knots,
            ("results", true) => Self::Results,
            ("surface", true) => Self::SurfaceWritten,
            ("lists", true) => Self::ListsWritten,
            ("shapes", true) => Self::Shapes,
            ("curves", true) => Self::Curves,
            _ => return None,
        })
    }

    /// Whether all stitches of a type, or all points of a yarn, read the same bytes, so that caches answer.
    pub fn is_shared(self) -> bool {
        matches!(self, Self::Stencil | Self::Table | Self::Known | Self::Yarns)
    }

    /// Whether it is bytes that are written.
    pub fn is_written(self) -> bool {
        self as usize >= Self::Points as usize
    }
}
