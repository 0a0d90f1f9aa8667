//! Meshes that are filled with a medium which neither ends nor absorbs: if they are open, or turned inside out, light that gets into it
//! scatters for ever, and so would the render.

use super::build::materials_null;
use super::{Material, PlacedMedium};
use crate::error::Result;
use crate::geometry::Shape;
use glam::Vec3;
use resolvent_scene as describe;
use std::collections::HashMap;

/// A shape as the scene describes it, and what became of it.
pub(super) struct Filled<'s> {
    pub described: &'s describe::Shape,
    /// Where it stands in the scene.
    pub place: String,
    pub shape: &'s Shape,
}

/// Refuses meshes of the world, or of one prototype, that an endless medium fills without an end.
///
/// The shapes that a medium fills are one body, which may have been cut up by material. Bodies with parts that are open by themselves
/// (rectangles, disks, cylinders) are not judged unless that is all there is: whether they meet is a matter of rounding.
///
/// # Errors
/// The medium, the shape, and what can be done.
pub(super) fn check<'s>(
    scene: &describe::Scene,
    medium: &PlacedMedium,
    materials: &[Material],
    shapes: impl Iterator<Item = Filled<'s>>,
) -> Result<()> {
    let body = shapes.filter(|f| {
        let of = f.described.interior.as_deref();
        of == Some(medium.name.as_str()) && is_entered(f.described, materials)
    });
    let Some((place, why)) = fault(body) else {
        return Ok(());
    };
    let block = &scene.media[&medium.name].block;
    let what = format!(
        "the medium '{}' scatters without loss and has no bounds, and {place}, which it fills, {why}: light that gets in would scatter for ever. Close the mesh with its front faces outside, or give the medium bounds or an albedo below 1",
        medium.name
    );
    let file = &scene.source.file;
    Err(describe::Problem::new(file, block.place.clone(), what).into())
}

/// True if a medium has no bounds of its own and some lane of it is never absorbed.
pub(super) fn is_endless(m: &PlacedMedium, lanes: u32) -> bool {
    if m.free || m.medium.info.bounds.extent().is_finite() {
        return false;
    }
    // One that fails here fails on the way, where it can say so.
    m.medium.coefficients(Vec3::ZERO).is_ok_and(|c| {
        let lanes = 0..lanes as usize;
        lanes
            .into_iter()
            .any(|k| c.sigma_t[k] > 0.0 && c.sigma_s[k] >= c.sigma_t[k])
    })
}

/// True if light can get through a surface.
fn is_entered(described: &describe::Shape, materials: &[Material]) -> bool {
    let Some(name) = &described.material else {
        return described.emission.is_none();
    };
    let index = materials.iter().position(|m| m.name == *name);
    index.is_some_and(|i| materials[i].bsdf.refracts() || materials_null(materials, i as u32))
}

/// What is wrong with a body, and with which of its shapes.
fn fault<'s>(body: impl Iterator<Item = Filled<'s>>) -> Option<(String, String)> {
    let mut edges: HashMap<[[u32; 3]; 2], (i32, usize)> = HashMap::new();
    let (mut volume, mut origin, mut places, mut open) = (0.0, None, Vec::new(), None);
    for f in body {
        let Shape::Mesh(mesh) = f.shape else {
            if !matches!(f.shape, Shape::Sphere(_)) {
                open = Some(f.place);
            }
            continue;
        };
        let at = *origin.get_or_insert(mesh.positions.first().copied().unwrap_or_default());
        for t in &mesh.indices {
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            let [u, v, w] = [a, b, c].map(|p| (p - at).as_dvec3());
            volume += u.dot(v.cross(w));
            for [from, to] in [[a, b], [b, c], [c, a]].map(|e| e.map(bits)) {
                let (edge, turn) = if from < to {
                    ([from, to], 1)
                } else {
                    ([to, from], -1)
                };
                if from != to {
                    edges.entry(edge).or_insert((0, places.len())).0 += turn;
                }
            }
        }
        places.push(f.place);
    }
    if let Some(place) = open {
        // With others it may be closed.
        return places.is_empty().then(|| (place, "is open".into()));
    }
    // Every edge is passed as often in one direction as in the other, or the surface ends there.
    let loose = edges.values().filter(|(turns, _)| *turns != 0);
    let count = loose.clone().count();
    if let Some(first) = loose.map(|(_, mesh)| *mesh).min() {
        let why = format!(
            "is open: {count} of its edges have a triangle on one side only, or triangles that face opposite ways"
        );
        return Some((places.swap_remove(first), why));
    }
    (volume < 0.0).then(|| (places.swap_remove(0), "is inside out".into()))
}

/// A position as a key; zero has one sign.
fn bits(p: Vec3) -> [u32; 3] {
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TriangleMesh;

    /// A tetrahedron; of three sides, or turned.
    fn body(sides: &[[u32; 3]]) -> Shape {
        Shape::Mesh(TriangleMesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            indices: sides.to_vec(),
            ..TriangleMesh::default()
        })
    }

    fn judged(shapes: &[&Shape]) -> Option<String> {
        let described = describe::Scene::parse(
            br#"{"resolvent": 1, "camera": {"type": "perspective", "origin": [0, 0, 4], "target": [0, 0, 0], "fov_x_deg": 40},
                "film": {"resolution": [8, 8]}, "lights": [], "media": {"m": {"plugin": "homogeneous"}},
                "shapes": [{"type": "sphere", "center": [0, 0, 0], "radius": 1, "interior": "m"}]}"#,
            "s.json",
        )
        .unwrap();
        let filled = shapes.iter().enumerate().map(|(i, shape)| Filled {
            described: &described.shapes[0],
            place: format!("$.shapes[{i}]"),
            shape,
        });
        fault(filled).map(|(place, why)| format!("{place} {why}"))
    }

    #[test]
    fn closed_open_and_turned() {
        let sides = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        assert_eq!(judged(&[&body(&sides)]), None);
        let turned = sides.map(|[a, b, c]| [a, c, b]);
        assert_eq!(
            judged(&[&body(&turned)]).unwrap(),
            "$.shapes[0] is inside out"
        );
        let open = judged(&[&body(&sides[..3])]).unwrap();
        assert!(
            open.starts_with("$.shapes[0] is open: 3 of its edges"),
            "{open}"
        );
        // One side faces the other way.
        let mixed = [sides[0], sides[1], sides[2], turned[3]];
        assert!(judged(&[&body(&mixed)]).unwrap().contains("is open"));
        // Cut up by material, it is still closed.
        assert_eq!(judged(&[&body(&sides[..1]), &body(&sides[1..])]), None);
        // A hollow in it is turned the other way.
        let small: Vec<Shape> = [body(&turned)]
            .into_iter()
            .map(|shape| match shape {
                Shape::Mesh(m) => Shape::Mesh(TriangleMesh {
                    positions: m.positions.iter().map(|p| 0.1 * *p + 0.1).collect(),
                    ..m
                }),
                other => other,
            })
            .collect();
        assert_eq!(judged(&[&body(&sides), &small[0]]), None);
    }
}
