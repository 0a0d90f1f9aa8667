//! From elements to a mesh.

use crate::body::Body;
use crate::header::{Element, Header, Kind, Scalar};
use crate::{Fault, Mesh, Place, quoted};

/// Reads the elements of a file whose header is known.
pub(crate) fn assemble(header: &Header, bytes: &[u8]) -> Result<Mesh, Fault> {
    let mut body = Body::new(header, bytes);
    let mut mesh = Mesh::default();
    let (mut vertices, mut faces) = (false, false);
    for element in &header.elements {
        match element.name.as_slice() {
            b"vertex" => {
                read_vertices(&mut body, element, &mut mesh)?;
                vertices = true;
            }
            b"face" => {
                // Faces may come before the vertices; then indices are checked afterwards.
                let known = vertices.then_some(mesh.positions.len());
                read_faces(&mut body, element, known, &mut mesh.indices)?;
                faces = true;
            }
            b"tristrips" if element.count > 0 => {
                let reason = "triangle strips are not supported; convert them to faces".into();
                return Err(Fault {
                    place: Place::Line(element.line),
                    reason,
                });
            }
            _ => body.skip_element(element)?,
        }
    }
    let missing = |name| Fault {
        place: Place::Line(header.lines),
        reason: format!("the header declares no element \"{name}\""),
    };
    if !vertices {
        return Err(missing("vertex"));
    }
    if !faces {
        return Err(missing("face"));
    }
    let count = mesh.positions.len();
    if let Some(i) = mesh
        .indices
        .iter()
        .flatten()
        .find(|&&i| i as usize >= count)
    {
        return Err(body.fault(format!(
            "a face refers to vertex {i}, but there are {count} vertices"
        )));
    }
    Ok(mesh)
}

/// Numbers of a vertex that are taken.
const SLOTS: usize = 12;

/// Where a vertex property goes: component of position (0-2), normal (3-5), texture coordinates (6-7) or colour (8-11).
fn vertex_slots(element: &Element) -> Result<Vec<Option<usize>>, Fault> {
    let mut slots = vec![None; element.properties.len()];
    let mut take = |names: &[&str], first: usize| -> bool {
        let found: Vec<_> = names.iter().filter_map(|n| element.find(n)).collect();
        let scalars = found
            .iter()
            .all(|&i| matches!(element.properties[i].kind, Kind::Scalar(_)));
        let complete = scalars && found.len() == names.len();
        if complete {
            for (k, i) in found.into_iter().enumerate() {
                slots[i] = Some(first + k);
            }
        }
        complete
    };
    if !take(&["x", "y", "z"], 0) {
        let reason = "element \"vertex\" lacks the scalar properties x, y and z".into();
        return Err(Fault {
            place: Place::Line(element.line),
            reason,
        });
    }
    take(&["nx", "ny", "nz"], 3);
    let pairs = [
        ["u", "v"],
        ["s", "t"],
        ["texture_u", "texture_v"],
        ["texture_s", "texture_t"],
    ];
    let _ = pairs.iter().any(|pair| take(pair, 6));
    for (colors, alpha) in [(["red", "green", "blue"], "alpha"), (["r", "g", "b"], "a")] {
        if take(&colors, 8) {
            take(&[alpha], 11);
            break;
        }
    }
    Ok(slots)
}

fn read_vertices(body: &mut Body, element: &Element, mesh: &mut Mesh) -> Result<(), Fault> {
    let slots = vertex_slots(element)?;
    let plausible = body.plausible_count(element);
    mesh.positions.reserve_exact(plausible);
    let mut normals = slots
        .contains(&Some(3))
        .then(|| Vec::with_capacity(plausible));
    let mut uvs = slots
        .contains(&Some(6))
        .then(|| Vec::with_capacity(plausible));
    let mut colors = slots
        .contains(&Some(8))
        .then(|| Vec::with_capacity(plausible));
    for vertex in 0..element.count {
        let mut values = [0f32; SLOTS];
        values[11] = 1.0;
        for (property, slot) in element.properties.iter().zip(&slots) {
            match (property.kind, slot) {
                (Kind::Scalar(s), &Some(k)) => {
                    let place = body.place();
                    let value = body.value(s)?;
                    values[k] = value as f32;
                    if !values[k].is_finite() {
                        let name = quoted(&property.name);
                        let reason =
                            format!("{name} of vertex {vertex} is {value}; not a finite f32");
                        return Err(Fault { place, reason });
                    }
                    if k >= 8 {
                        values[k] = color(value, s, k == 11);
                        if values[k] < 0.0 {
                            let name = quoted(&property.name);
                            let reason = format!(
                                "{name} of vertex {vertex} is {value}; a colour is at least 0"
                            );
                            return Err(Fault { place, reason });
                        }
                    }
                }
                (kind, _) => body.skip(kind)?,
            }
        }
        let [x, y, z, nx, ny, nz, u, v, rgba @ ..] = values;
        mesh.positions.push([x, y, z]);
        if let Some(normals) = &mut normals {
            normals.push([nx, ny, nz]);
        }
        if let Some(uvs) = &mut uvs {
            uvs.push([u, v]);
        }
        if let Some(colors) = &mut colors {
            colors.push(rgba);
        }
    }
    (mesh.normals, mesh.uvs, mesh.colors) = (normals, uvs, colors);
    Ok(())
}

/// A component of a colour as a linear number.
fn color(value: f64, scalar: Scalar, is_alpha: bool) -> f32 {
    let Some(largest) = scalar.largest() else {
        return value as f32;
    };
    let e = value / largest;
    // The curve of IEC 61966-2-1.
    let linear = if is_alpha {
        e
    } else if e <= 0.040_45 {
        e / 12.92
    } else {
        ((e + 0.055) / 1.055).powf(2.4)
    };
    linear as f32
}

fn read_faces(
    body: &mut Body,
    element: &Element,
    vertices: Option<usize>,
    indices: &mut Vec<[u32; 3]>,
) -> Result<(), Fault> {
    let place = Place::Line(element.line);
    let list = element
        .find("vertex_indices")
        .or_else(|| element.find("vertex_index"));
    let kind = list.map(|i| element.properties[i].kind);
    let (Some(list), Some(Kind::List { item, .. })) = (list, kind) else {
        if element.count == 0 {
            return Ok(());
        }
        let reason =
            "element \"face\" lacks the list property vertex_indices or vertex_index".into();
        return Err(Fault { place, reason });
    };
    if matches!(item, Scalar::F32 | Scalar::F64) {
        return Err(Fault {
            place,
            reason: "the vertex indices of faces are not of an integer type".into(),
        });
    }
    indices.reserve(body.plausible_count(element));
    for face in 0..element.count {
        for (i, property) in element.properties.iter().enumerate() {
            match property.kind {
                Kind::List { count, item } if i == list => {
                    let place = body.place();
                    let corners = body.list_count(count, item)?;
                    if corners < 3 {
                        let reason =
                            format!("face {face} has {corners} vertices; at least 3 are needed");
                        return Err(Fault { place, reason });
                    }
                    let first = corner(body, item, face, vertices)?;
                    let mut last = corner(body, item, face, vertices)?;
                    for _ in 2..corners {
                        let next = corner(body, item, face, vertices)?;
                        indices.push([first, last, next]);
                        last = next;
                    }
                }
                kind => body.skip(kind)?,
            }
        }
    }
    Ok(())
}

/// One vertex index of a face.
fn corner(body: &mut Body, item: Scalar, face: u64, vertices: Option<usize>) -> Result<u32, Fault> {
    let place = body.place();
    let value = body.value(item)?;
    let limit = vertices.map_or(f64::from(u32::MAX), |n| n as f64 - 1.0);
    if value >= 0.0 && value <= limit {
        return Ok(value as u32);
    }
    let reason = match vertices {
        Some(n) => format!("face {face} refers to vertex {value}, but there are {n} vertices"),
        None => format!("face {face} refers to vertex {value}"),
    };
    Err(Fault { place, reason })
}
