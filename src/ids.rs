//! Typed indices: a face index cannot be used as a vertex index.

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, bytemuck::Pod, bytemuck::Zeroable)]
        #[repr(transparent)]
        pub struct $name(pub u32);

        impl $name {
            /// The id as an array index.
            #[inline]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl From<usize> for $name {
            #[inline]
            fn from(index: usize) -> Self {
                debug_assert!(index <= u32::MAX as usize);
                Self(index as u32)
            }
        }
    };
}

id! {
    /// A vertex of a stitch mesh, in file order, counted from 0.
    VertexId
}
id! {
    /// A face (one stitch) of a stitch mesh, in file order, counted from 0.
    FaceId
}
id! {
    /// A stitch type (name and edge labels) of a stitch mesh, counted from 0.
    TypeId
}
id! {
    /// A template of a library, counted from 0.
    TemplateId
}
