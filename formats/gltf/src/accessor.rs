//! Accessors: typed views of buffers, with every bound checked.

use gltf::json::accessor::{ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{self, Index};

use crate::buffers::Buffers;
use crate::error::Fallible;

/// Reads accessors of one model.
pub(crate) struct Accessors<'c> {
    root: &'c json::Root,
    buffers: &'c Buffers<'c>,
}

/// The elements of an accessor in a buffer.
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

    fn iter(&self) -> impl Iterator<Item = &'b [u8]> {
        let (bytes, stride, size) = (self.bytes, self.stride, self.size);
        (0..self.count).map(move |i| bytes.get(i * stride..i * stride + size).unwrap_or_default())
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

impl<'c> Accessors<'c> {
    pub fn new(root: &'c json::Root, buffers: &'c Buffers<'c>) -> Accessors<'c> {
        Accessors { root, buffers }
    }

    /// Vectors of `N` numbers each.
    pub fn vectors<const N: usize>(&self, index: Index<json::Accessor>) -> Fallible<Vec<[f64; N]>> {
        let kind = match N {
            1 => Type::Scalar,
            2 => Type::Vec2,
            3 => Type::Vec3,
            _ => Type::Vec4,
        };
        let (flat, _) = self.read(index, kind)?;
        Ok(flat.as_chunks::<N>().0.to_vec())
    }

    /// Colours with opacity, 1 if the file gives none; in [0, ∞).
    pub fn colors(&self, index: Index<json::Accessor>) -> Fallible<Vec<[f64; 4]>> {
        let accessor = self.root.accessors.get(index.value());
        let rgb = accessor.is_some_and(|a| matches!(a.type_, Checked::Valid(Type::Vec3)));
        let mut all: Vec<[f64; 4]> = if rgb {
            let opaque = |[r, g, b]: [f64; 3]| [r, g, b, 1.0];
            self.vectors::<3>(index)?.into_iter().map(opaque).collect()
        } else {
            self.vectors::<4>(index)?
        };
        all.iter_mut().flatten().for_each(|v| *v = v.max(0.0));
        Ok(all)
    }

    /// Indices of vertices.
    pub fn indices(&self, index: Index<json::Accessor>) -> Fallible<Vec<u32>> {
        let (flat, component) = self.read(index, Type::Scalar)?;
        match component {
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32 => {
                Ok(flat.into_iter().map(|v| v as u32).collect())
            }
            other => Err(format!(
                "accessors[{}]: indices are {other:?}",
                index.value()
            )),
        }
    }

    fn read(
        &self,
        index: Index<json::Accessor>,
        kind: Type,
    ) -> Fallible<(Vec<f64>, ComponentType)> {
        self.checked(index.value(), kind)
            .map_err(|what| format!("accessors[{}]: {what}", index.value()))
    }

    fn checked(&self, index: usize, kind: Type) -> Fallible<(Vec<f64>, ComponentType)> {
        let a = self.root.accessors.get(index).ok_or("does not exist")?;
        let (Checked::Valid(component), Checked::Valid(found)) = (&a.component_type, &a.type_)
        else {
            return Err("is of an unknown type".into());
        };
        let component = component.0;
        if *found != kind {
            return Err(format!("is {found:?} where {kind:?} is needed"));
        }
        let n = kind.multiplicity();
        let size = n * component_bytes(component);
        let count = usize::try_from(a.count.0).unwrap_or(usize::MAX);
        let mut values = match a.buffer_view {
            Some(view) => {
                let view = self.buffers.view(view.value())?;
                let offset = a.byte_offset.map_or(0, |o| o.0);
                let elements = Elements::new(view, offset, size, count)?;
                let mut values = Vec::with_capacity(count * n);
                for bytes in elements.iter() {
                    let parts = bytes.chunks(component_bytes(component));
                    values.extend(parts.map(|b| number(b, component, a.normalized)));
                }
                values
            }
            // Zeros cost no byte of file: there are not more of them than it has bytes.
            None if count <= self.buffers.bytes => vec![0.0; count * n],
            None => return Err(format!("has {count} elements without data")),
        };
        if let Some(sparse) = &a.sparse {
            let changes = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
            let Checked::Valid(index_type) = &sparse.indices.component_type else {
                return Err("its sparse indices are of an unknown type".into());
            };
            let index_type = match index_type.0 {
                t @ (ComponentType::U8 | ComponentType::U16 | ComponentType::U32) => t,
                _ => return Err("its sparse indices are of an unknown type".into()),
            };
            let at = Elements::new(
                self.buffers.view(sparse.indices.buffer_view.value())?,
                sparse.indices.byte_offset.0,
                component_bytes(index_type),
                changes,
            )?;
            let new = Elements::new(
                self.buffers.view(sparse.values.buffer_view.value())?,
                sparse.values.byte_offset.0,
                size,
                changes,
            )?;
            for (at, new) in at.iter().zip(new.iter()) {
                let at = number(at, index_type, false) as usize;
                let slot = values.get_mut(at * n..(at + 1) * n);
                let slot = slot.ok_or_else(|| format!("replaces its element {at} of {count}"))?;
                let parts = new.chunks(component_bytes(component));
                for (v, b) in slot.iter_mut().zip(parts) {
                    *v = number(b, component, a.normalized);
                }
            }
        }
        if values.iter().any(|v| !v.is_finite()) {
            return Err("has a value that is infinite or no number".into());
        }
        Ok((values, component))
    }
}
