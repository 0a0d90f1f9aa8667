//! Accessors: typed views of buffers, with every bound checked.
//!
//! Nothing is decoded before it is asked for: primitives often share vertices, and each takes only its own.

use gltf::json::accessor::{self, ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{self, Index};
use std::collections::HashSet;

use crate::buffers::Buffers;
use crate::error::Fallible;

/// What a model may have for each of its bytes, and without any, of things that many of its parts can name at no cost: a small
/// file must neither become a huge scene nor take forever.
const PER_BYTE: usize = 16;
const FREE: usize = 1 << 16;

/// Most such things in a model of a size in bytes.
pub(crate) fn allowance(bytes: usize) -> usize {
    bytes.saturating_mul(PER_BYTE).saturating_add(FREE)
}

/// Finds accessors of one model.
pub(crate) struct Accessors<'c> {
    root: &'c json::Root,
    buffers: &'c Buffers<'c>,
    /// Accessors whose sparse indices are known to increase.
    ordered: HashSet<usize>,
    /// Sparse indices that may still be looked at to find that out.
    budget: usize,
}

/// Elements of one type.
pub(crate) struct Accessor<'c> {
    index: usize,
    kind: Type,
    component: ComponentType,
    normalized: bool,
    count: usize,
    /// `None`: zeros.
    dense: Option<Elements<'c>>,
    sparse: Option<Sparse<'c>>,
}

/// Elements that are replaced: their indices, which increase (glTF 2.0, §3.6.2.3), and their values.
struct Sparse<'c> {
    indices: Elements<'c>,
    component: ComponentType,
    values: Elements<'c>,
}

/// Elements in a buffer.
#[derive(Clone, Copy)]
struct Elements<'b> {
    bytes: &'b [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'b> Elements<'b> {
    fn new(
        (bytes, stride): (&'b [u8], Option<usize>),
        offset: u64,
        size: usize,
        count: usize,
    ) -> Fallible<Elements<'b>> {
        let stride = stride.unwrap_or(size);
        let bytes = usize::try_from(offset).ok().and_then(|o| bytes.get(o..));
        let needed = count
            .checked_sub(1)
            .map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size));
        match (bytes, needed) {
            (Some(bytes), Some(needed)) if needed <= bytes.len() && stride >= size => {
                Ok(Elements {
                    bytes,
                    stride,
                    size,
                    count,
                })
            }
            _ => Err(format!(
                "{count} elements of {size} bytes reach beyond the end of its buffer view"
            )),
        }
    }

    /// The bytes of element `i`, which is below `count`.
    #[inline]
    fn get(&self, i: usize) -> &'b [u8] {
        let start = i * self.stride;
        self.bytes.get(start..start + self.size).unwrap_or_default()
    }
}

fn component_bytes(t: ComponentType) -> usize {
    match t {
        ComponentType::I8 | ComponentType::U8 => 1,
        ComponentType::I16 | ComponentType::U16 => 2,
        ComponentType::U32 | ComponentType::F32 => 4,
    }
}

/// A number as the specification decodes it (glTF 2.0, §3.11: normalized integers).
fn number(bytes: &[u8], t: ComponentType, normalized: bool) -> f64 {
    let unit = |value: f64, max: f64| {
        if normalized {
            (value / max).max(-1.0)
        } else {
            value
        }
    };
    match (t, bytes) {
        (ComponentType::U8, [b]) => unit(f64::from(*b), 255.0),
        (ComponentType::I8, [b]) => unit(f64::from(*b as i8), 127.0),
        (ComponentType::U16, [a, b]) => unit(f64::from(u16::from_le_bytes([*a, *b])), 65_535.0),
        (ComponentType::I16, [a, b]) => unit(f64::from(i16::from_le_bytes([*a, *b])), 32_767.0),
        (ComponentType::U32, [a, b, c, d]) => f64::from(u32::from_le_bytes([*a, *b, *c, *d])),
        (ComponentType::F32, [a, b, c, d]) => f64::from(f32::from_le_bytes([*a, *b, *c, *d])),
        _ => 0.0,
    }
}

impl Sparse<'_> {
    #[inline]
    fn index(&self, k: usize) -> usize {
        number(self.indices.get(k), self.component, false) as usize
    }

    /// The position of the index `i`.
    fn find(&self, i: usize) -> Option<usize> {
        let (mut low, mut high) = (0, self.indices.count);
        while low < high {
            let middle = low + (high - low) / 2;
            if self.index(middle) < i {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        (low < self.indices.count && self.index(low) == i).then_some(low)
    }
}

impl Accessor<'_> {
    /// Number of elements.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Element `i`, which is below [`Accessor::len`], of `N` finite numbers.
    #[inline]
    pub fn vector<const N: usize>(&self, i: usize) -> Fallible<[f64; N]> {
        let replaced = self
            .sparse
            .as_ref()
            .and_then(|s| s.find(i).map(|k| s.values.get(k)));
        let bytes = replaced.or_else(|| self.dense.as_ref().map(|d| d.get(i)));
        let mut out = [0.0; N];
        let parts = bytes.unwrap_or_default();
        let parts = parts.chunks_exact(component_bytes(self.component));
        for (v, b) in out.iter_mut().zip(parts) {
            *v = number(b, self.component, self.normalized);
        }
        if out.iter().any(|v| !v.is_finite()) {
            return Err(self.wrong("has a value that is infinite or no number"));
        }
        Ok(out)
    }

    /// A colour with opacity, 1 if the file gives none; in [0, ∞).
    pub fn color(&self, i: usize) -> Fallible<[f64; 4]> {
        let color = if self.kind == Type::Vec3 {
            let [r, g, b] = self.vector(i)?;
            [r, g, b, 1.0]
        } else {
            self.vector(i)?
        };
        Ok(color.map(|v| v.max(0.0)))
    }

    fn wrong(&self, what: &str) -> String {
        format!("accessors[{}]: {what}", self.index)
    }
}

impl<'c> Accessors<'c> {
    /// `bytes` is the size of the model with its buffers.
    pub fn new(root: &'c json::Root, buffers: &'c Buffers<'c>, bytes: usize) -> Accessors<'c> {
        Accessors {
            root,
            buffers,
            ordered: HashSet::new(),
            budget: allowance(bytes),
        }
    }

    /// Vectors of one of the types in `kinds`.
    pub fn get(&mut self, index: Index<json::Accessor>, kinds: &[Type]) -> Fallible<Accessor<'c>> {
        self.checked(index.value(), kinds)
            .map_err(|what| format!("accessors[{}]: {what}", index.value()))
    }

    /// Indices of vertices.
    pub fn indices(&mut self, index: Index<json::Accessor>) -> Fallible<Vec<u32>> {
        let all = self.get(index, &[Type::Scalar])?;
        match all.component {
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32 => (0..all.len())
                .map(|i| all.vector(i).map(|[v]| v as u32))
                .collect(),
            other => Err(all.wrong(&format!("indices are {other:?}"))),
        }
    }

    fn checked(&mut self, index: usize, kinds: &[Type]) -> Fallible<Accessor<'c>> {
        let a = self.root.accessors.get(index).ok_or("does not exist")?;
        let (Checked::Valid(component), Checked::Valid(kind)) = (&a.component_type, &a.type_)
        else {
            return Err("is of an unknown type".into());
        };
        let (component, kind) = (component.0, *kind);
        if !kinds.contains(&kind) {
            let needed: Vec<_> = kinds.iter().map(|k| format!("{k:?}")).collect();
            return Err(format!(
                "is {kind:?} where {} is needed",
                needed.join(" or ")
            ));
        }
        let size = kind.multiplicity() * component_bytes(component);
        let count = usize::try_from(a.count.0).unwrap_or(usize::MAX);
        let dense = match a.buffer_view {
            Some(view) => {
                let view = self.buffers.view(view.value())?;
                let offset = a.byte_offset.map_or(0, |o| o.0);
                Some(Elements::new(view, offset, size, count)?)
            }
            // Zeros cost no byte of file: there are not more of them than it has bytes.
            None if count <= self.buffers.bytes => None,
            None => return Err(format!("has {count} elements without data")),
        };
        let sparse = a
            .sparse
            .as_ref()
            .map(|s| self.sparse(index, s, size, count));
        Ok(Accessor {
            index,
            kind,
            component,
            normalized: a.normalized,
            count,
            dense,
            sparse: sparse.transpose()?,
        })
    }

    /// What replaces elements of an accessor of `count` elements of `size` bytes.
    fn sparse(
        &mut self,
        accessor: usize,
        sparse: &accessor::sparse::Sparse,
        size: usize,
        count: usize,
    ) -> Fallible<Sparse<'c>> {
        let changes = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
        let component = match &sparse.indices.component_type {
            Checked::Valid(t) => t.0,
            Checked::Invalid => return Err("its sparse indices are of an unknown type".into()),
        };
        if !matches!(
            component,
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32
        ) {
            return Err("its sparse indices are of an unknown type".into());
        }
        let out = Sparse {
            indices: Elements::new(
                self.buffers.view(sparse.indices.buffer_view.value())?,
                sparse.indices.byte_offset.0,
                component_bytes(component),
                changes,
            )?,
            component,
            values: Elements::new(
                self.buffers.view(sparse.values.buffer_view.value())?,
                sparse.values.byte_offset.0,
                size,
                changes,
            )?,
        };
        if self.ordered.insert(accessor) {
            let left = self.budget.checked_sub(changes);
            self.budget = left.ok_or(
                "with it the model has more sparse elements than a file of its size can describe",
            )?;
            if let Some(k) = (1..changes).find(|&k| out.index(k - 1) >= out.index(k)) {
                return Err(format!(
                    "its sparse indices have to increase, and {} comes before {}",
                    out.index(k - 1),
                    out.index(k)
                ));
            }
            if let Some(last) = changes.checked_sub(1).map(|k| out.index(k))
                && last >= count
            {
                return Err(format!("replaces its element {last} of {count}"));
            }
        }
        Ok(out)
    }
}
