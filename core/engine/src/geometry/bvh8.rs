//! The eight-wide hierarchy: node layout and child codes.

/// Box of a primitive or a subtree, as (min, max) per axis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub min: [f32; 3],
    pub max: [f32; 3],
}

impl Bounds {
    pub const EMPTY: Self = Self {
        min: [f32::INFINITY; 3],
        max: [f32::NEG_INFINITY; 3],
    };

    pub fn include(&mut self, other: &Self) {
        for i in 0..3 {
            self.min[i] = self.min[i].min(other.min[i]);
            self.max[i] = self.max[i].max(other.max[i]);
        }
    }

    pub fn include_point(&mut self, p: [f32; 3]) {
        self.include(&Self { min: p, max: p });
    }

    /// Moves every face outwards by at least `pad`.
    pub fn padded(mut self, pad: f32) -> Self {
        for i in 0..3 {
            self.min[i] = (self.min[i] - pad).next_down();
            self.max[i] = (self.max[i] + pad).next_up();
        }
        self
    }
}

/// Eight child boxes, one lane each, and what the lanes lead to. Four cache lines.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Node8 {
    /// Rows min x, max x, min y, max y, min z, max z. An unused lane holds an inverted infinite box, which no ray meets.
    pub bounds: [[f32; 8]; 6],
    pub child: [Child; 8],
}

impl Node8 {
    pub const EMPTY: Self = {
        let (lo, hi) = ([f32::INFINITY; 8], [f32::NEG_INFINITY; 8]);
        Self {
            bounds: [lo, hi, lo, hi, lo, hi],
            child: [Child::EMPTY; 8],
        }
    };

    pub fn set(&mut self, lane: usize, bounds: &Bounds, child: Child) {
        for axis in 0..3 {
            self.bounds[2 * axis][lane] = bounds.min[axis];
            self.bounds[2 * axis + 1][lane] = bounds.max[axis];
        }
        self.child[lane] = child;
    }
}

/// What a lane leads to, in 32 bits: an inner node (bit 31 clear, its index in the rest), or a leaf: bit 31 set, bit 30 set
/// for quadrics and clear for triangle packets, bits 27-29 the number of items less one, bits 0-26 the first item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub(super) struct Child(pub u32);

/// Largest number of packets, quadrics or primitives one hierarchy can hold (2²⁷).
pub(super) const MAX_ITEMS: usize = 1 << 27;

impl Child {
    const LEAF: u32 = 1 << 31;
    const QUADRIC: u32 = 1 << 30;
    const FIRST: u32 = (1 << 27) - 1;
    /// Most items in one leaf.
    pub const MAX_COUNT: usize = 8;
    const EMPTY: Self = Self(Self::LEAF | Self::FIRST);

    pub fn node(index: usize) -> Self {
        assert!(index < MAX_ITEMS, "node index out of range");
        Self(index as u32)
    }

    pub fn leaf(quadrics: bool, first: usize, count: usize) -> Self {
        assert!(
            first < MAX_ITEMS && (1..=Self::MAX_COUNT).contains(&count),
            "leaf out of range"
        );
        let kind = if quadrics { Self::QUADRIC } else { 0 };
        Self(Self::LEAF | kind | ((count - 1) as u32) << 27 | first as u32)
    }

    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    #[inline(always)]
    pub fn is_quadrics(self) -> bool {
        self.0 & Self::QUADRIC != 0
    }

    /// Items of a leaf.
    #[inline(always)]
    pub fn items(self) -> std::ops::Range<usize> {
        let first = (self.0 & Self::FIRST) as usize;
        first..first + ((self.0 >> 27) & 7) as usize + 1
    }
}
