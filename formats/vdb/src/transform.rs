//! From index space to world space.

use crate::error::{Fault, Parsed};
use crate::reader::Reader;

/// A linear map from index space to world space, in 64-bit floats: world coordinates of large scenes
/// do not fit 32 bits.
///
/// A voxel (i, j, k) is **centred** at the world position of index (i, j, k); its cube reaches from
/// −½ to +½ around it.
#[derive(Clone, Debug, PartialEq)]
pub struct Transform {
    /// OpenVDB's name of the map, for example `UniformScaleTranslateMap`.
    pub map_type: String,
    /// The 4×4 matrix M with world = M · (i, j, k, 1)ᵀ: `index_to_world[row][column]`, translation in
    /// the last column, last row 0 0 0 1. (OpenVDB's own `Mat4d` is the transpose.)
    pub index_to_world: [[f64; 4]; 4],
}

impl Transform {
    /// The world position of an index position.
    pub fn to_world(&self, index: [f64; 3]) -> [f64; 3] {
        let m = &self.index_to_world;
        [0, 1, 2].map(|r| m[r][0] * index[0] + m[r][1] * index[1] + m[r][2] * index[2] + m[r][3])
    }

    /// The index position of a world position, `None` if the map has no inverse.
    pub fn to_index(&self, world: [f64; 3]) -> Option<[f64; 3]> {
        let m = &self.index_to_world;
        let cofactor = |r: usize, c: usize| {
            let (r1, r2, c1, c2) = ((r + 1) % 3, (r + 2) % 3, (c + 1) % 3, (c + 2) % 3);
            m[r1][c1] * m[r2][c2] - m[r1][c2] * m[r2][c1]
        };
        let determinant: f64 = (0..3).map(|c| m[0][c] * cofactor(0, c)).sum();
        let offset = [0, 1, 2].map(|r| world[r] - m[r][3]);
        let index = [0, 1, 2]
            .map(|c| (0..3).map(|r| cofactor(r, c) * offset[r]).sum::<f64>() / determinant);
        index.iter().all(|x| x.is_finite()).then_some(index)
    }

    /// Lengths of the three edges of a voxel, in world units.
    pub fn voxel_size(&self) -> [f64; 3] {
        let m = &self.index_to_world;
        [0, 1, 2].map(|c| (m[0][c] * m[0][c] + m[1][c] * m[1][c] + m[2][c] * m[2][c]).sqrt())
    }

    fn diagonal(map_type: String, scale: [f64; 3], translation: [f64; 3]) -> Self {
        let mut m = [[0.0; 4]; 4];
        for axis in 0..3 {
            m[axis][axis] = scale[axis];
            m[axis][3] = translation[axis];
        }
        m[3][3] = 1.0;
        Self {
            map_type,
            index_to_world: m,
        }
    }
}

/// A transform, or the reason why the grid cannot be used although the map could be passed over.
pub(crate) enum Map {
    Linear(Transform),
    Refused(Fault),
}

/// Reads a map. An error means that what follows cannot be found either.
pub(crate) fn read(reader: &mut Reader<'_>) -> Parsed<Map> {
    let at = reader.position();
    let map_type = reader.string("the transform's type")?;
    let what = "the transform";
    let transform = match map_type.as_str() {
        "UniformScaleMap" | "ScaleMap" => {
            let scale = vector(reader)?;
            // Voxel size, inverse scale, its square and half of it: all follow from the scale.
            reader.skip(4 * 24, what)?;
            Transform::diagonal(map_type, scale, [0.0; 3])
        }
        "UniformScaleTranslateMap" | "ScaleTranslateMap" => {
            let (translation, scale) = (vector(reader)?, vector(reader)?);
            reader.skip(4 * 24, what)?;
            Transform::diagonal(map_type, scale, translation)
        }
        "TranslationMap" => Transform::diagonal(map_type, [1.0; 3], vector(reader)?),
        "AffineMap" | "UnitaryMap" => affine(reader, map_type)?,
        "NonlinearFrustumMap" => {
            // Box, taper and depth (8 doubles), then the affine map behind the frustum.
            reader.skip(8 * 8, what)?;
            let inner = reader.string("the frustum's inner map")?;
            if inner != "AffineMap" {
                let reason = format!("the frustum's inner map is '{inner}' instead of AffineMap");
                return Err(Fault::invalid(at, reason));
            }
            reader.skip(128, what)?;
            return Ok(Map::Refused(Fault::unsupported(
                at,
                "the grid has a NonlinearFrustumMap, which is not supported; resample it onto a grid with a linear transform",
            )));
        }
        other => {
            let reason = format!(
                "unknown transform '{}'",
                other.chars().take(60).collect::<String>()
            );
            return Err(Fault::unsupported(at, reason));
        }
    };
    let m = &transform.index_to_world;
    if m.iter().flatten().any(|x| !x.is_finite()) {
        return Ok(Map::Refused(Fault::invalid(
            at,
            "the transform is not finite",
        )));
    }
    let centre = transform.to_world([0.0; 3]);
    if transform.to_index(centre).is_none() {
        let reason = "the transform flattens space: it has no inverse";
        return Ok(Map::Refused(Fault::invalid(at, reason)));
    }
    Ok(Map::Linear(transform))
}

fn vector(reader: &mut Reader<'_>) -> Parsed<[f64; 3]> {
    let what = "the transform";
    Ok([reader.f64(what)?, reader.f64(what)?, reader.f64(what)?])
}

fn affine(reader: &mut Reader<'_>, map_type: String) -> Parsed<Transform> {
    let mut m = [[0.0; 4]; 4];
    // OpenVDB stores M for row vectors, row by row: its rows are our columns.
    for column in 0..4 {
        for row in &mut m {
            row[column] = reader.f64("the transform")?;
        }
    }
    // The last row is 0 0 0 1 in every affine map; OpenVDB ignores what else may be there.
    m[3] = [0.0, 0.0, 0.0, 1.0];
    Ok(Transform {
        map_type,
        index_to_world: m,
    })
}
