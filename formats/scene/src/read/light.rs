//! Lights.

use super::Reader;
use super::values::{flag, number, spectrum, text, to_world, vec3};
use crate::describe::{Environment, Light, Shaping, Vec3};
use crate::json::Node;
use crate::texture::{self, MAPPINGS};
use crate::transform::{Transform, cross, length, parallel};

impl Reader<'_> {
    pub(super) fn light(&mut self, node: &Node) -> Option<Light> {
        Some(match text(node, "type")? {
            "environment" => Light::Environment(match text(node, "image") {
                None => Environment::Constant {
                    radiance: spectrum(node, "radiance")?,
                },
                Some(image) => {
                    let rotation = self.rotation(node, true)?;
                    let scale = spectrum(node, "scale").unwrap_or([1.0; 3]);
                    Environment::Image {
                        file: image.into(),
                        mapping: text(node, "mapping")
                            .and_then(|w| texture::named(&MAPPINGS, w))
                            .unwrap_or_default(),
                        scale,
                        rotation,
                    }
                }
            }),
            "distant" => {
                let to_light = self.direction(node, "to_light")?;
                let angle_deg = number(node, "angle_deg").unwrap_or(0.0);
                Light::Distant {
                    to_light,
                    irradiance: spectrum(node, "irradiance")?,
                    angle_deg,
                }
            }
            "point" => Light::Point {
                position: vec3(node, "position")?,
                intensity: spectrum(node, "intensity")?,
            },
            "sun_sky" => Light::SunSky {
                to_sun: self.sun_direction(node)?,
                turbidity: number(node, "turbidity").unwrap_or(3.0),
                ground_albedo: spectrum(node, "ground_albedo").unwrap_or([0.2; 3]),
                scale: spectrum(node, "scale").unwrap_or([1.0; 3]),
                sun: flag(node, "sun").unwrap_or(true),
                sun_angle_deg: number(node, "sun_angle_deg").unwrap_or(0.533),
                rotation: self.rotation(node, false)?,
            },
            "spot" => {
                let angle_deg = number(node, "angle_deg")?;
                let inner_angle_deg = number(node, "inner_angle_deg").unwrap_or(angle_deg);
                if inner_angle_deg > angle_deg {
                    self.checker.report(
                        node.get("inner_angle_deg")?,
                        format!(
                            "expected at most angle_deg ({angle_deg}), found {inner_angle_deg}"
                        ),
                    );
                }
                Light::Spot {
                    position: vec3(node, "position")?,
                    direction: self.direction(node, "direction")?,
                    intensity: spectrum(node, "intensity")?,
                    angle_deg,
                    inner_angle_deg,
                }
            }
            "rectangle" => {
                let [corner, edge_u, edge_v] = self.rectangle(node)?;
                Light::Rectangle {
                    corner,
                    edge_u,
                    edge_v,
                    radiance: spectrum(node, "radiance")?,
                    two_sided: flag(node, "two_sided").unwrap_or(false),
                }
            }
            _ => return None,
        })
    }

    pub(super) fn rectangle(&mut self, node: &Node) -> Option<[Vec3; 3]> {
        let (edge_u, edge_v) = (vec3(node, "edge_u")?, vec3(node, "edge_v")?);
        if length(cross(edge_u, edge_v)) == 0.0 || parallel(edge_u, edge_v) {
            let what =
                format!("expected two edges that span an area, found {edge_u:?} and {edge_v:?}");
            self.checker.report(node, what);
        }
        Some([vec3(node, "corner")?, edge_u, edge_v])
    }

    /// A direction towards the sun, from either way to give it.
    pub(super) fn sun_direction(&mut self, node: &Node) -> Option<Vec3> {
        if let Some(elevation) = number(node, "elevation_deg") {
            let azimuth = number(node, "azimuth_deg").unwrap_or(0.0).to_radians();
            let (sin, cos) = elevation.to_radians().sin_cos();
            return Some([cos * azimuth.sin(), sin, cos * azimuth.cos()]);
        }
        let to_sun = self.direction(node, "to_sun")?;
        if to_sun[1] < 0.0 {
            let what = format!("expected a sun above the horizon (y ≥ 0), found {to_sun:?}");
            self.checker.report(node.get("to_sun")?, what);
        }
        Some(to_sun)
    }

    /// A transform that must be a rotation, or may mirror besides.
    pub(super) fn rotation(&mut self, node: &Node, mirrors: bool) -> Option<Transform> {
        let rotation = to_world(node)?;
        let fault = rotation.rotation_fault(mirrors);
        if let (Some(at), Some(fault)) = (node.get("transform"), fault) {
            self.checker
                .report(at, format!("expected a rotation, found {fault}"));
        }
        Some(rotation)
    }

    /// A vector that must not be zero.
    pub(super) fn direction(&mut self, node: &Node, key: &str) -> Option<Vec3> {
        let v = vec3(node, key)?;
        if length(v) == 0.0 {
            self.checker.report(
                node.get(key)?,
                "expected a direction that is not zero, found [0, 0, 0]",
            );
        }
        Some(v)
    }

    pub(super) fn shaping(&mut self, node: &Node) -> Option<Shaping> {
        Some(Shaping {
            axis: self.direction(node, "axis")?,
            angle_deg: number(node, "angle_deg").unwrap_or(360.0),
            softness: number(node, "softness").unwrap_or(0.0),
            focus: number(node, "focus").unwrap_or(0.0),
            focus_tint: spectrum(node, "focus_tint").unwrap_or_default(),
        })
    }
}
